"""Vectorizations: ranges or points to segments."""

from __future__ import annotations

from linefix.mounted import motion_warning
from vectorization import VectorizationOptions

from ..schemas.requests import VectorizeRequest
from .answers import vectorization_json
from .job import Done, Job
from .scanning import range_scan, vectorize_laser, vectorize_points, viewpoint_of

_PLACES = ("", "/options")  # where scan and options stand in the request


def answer_vectorization(asked: VectorizeRequest, job: Job) -> Done:
    """Cut a scan into directed segments.

    Raises
    ------
    InvalidRequestError
        When it is not what the library takes.
    """
    how = asked.options
    options = VectorizationOptions(how.sigma, how.min_points, how.min_length, how.max_gap)
    job.watch.lap("decode")
    if asked.laser is not None:
        seen = range_scan(asked.laser, asked.twist, _PLACES[0])
        found, moving = vectorize_laser(seen, options, _PLACES), motion_warning(seen)
    else:
        moving = None
        assert asked.points is not None  # the model takes exactly one of the two
        found = vectorize_points(asked.points, options, viewpoint_of(asked.viewpoint), _PLACES)
    job.watch.lap("search")
    return job.done(vectorization_json(found, moving))
