"""Vectorizations: ranges or points to segments."""

from __future__ import annotations

from linefix.answers import Json, vectorization_json
from linefix.ranges import motion_warning
from vectorization import VectorizationOptions

from ..schemas.requests import VectorizeRequest
from .job import Done, Job
from .scans import range_scan, vectorize_laser, vectorize_points, viewpoint_of

_PLACES = ("", "/options")  # where scan and options stand in the request


def answer_vectorization(asked: VectorizeRequest, job: Job) -> Done:
    """Cut a scan into directed segments; raises `InvalidRequestError` where the library refuses it."""
    job.watch.lap("decode")
    answer = vectorization_of(asked)
    job.watch.lap("search")
    return job.done(answer)


def vectorization_of(asked: VectorizeRequest) -> Json:
    """Return the segments of a scan, and the warnings about it.

    Raises
    ------
    InvalidRequestError
        When the library rejects it.
    """
    how = asked.options
    options = VectorizationOptions(how.sigma, how.min_points, how.min_length, how.max_gap)
    if asked.laser is None:
        assert asked.points is not None  # the model takes exactly one of the two
        return vectorization_json(vectorize_points(asked.points, options, viewpoint_of(asked.viewpoint), _PLACES))
    seen = range_scan(asked.laser, asked.twist, _PLACES[0])
    return vectorization_json(vectorize_laser(seen, options, _PLACES), motion_warning(seen))
