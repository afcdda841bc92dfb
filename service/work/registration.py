"""Registrations: the pose from known correspondences."""

from __future__ import annotations

from registration import Segments, register, register_estimating

from ..schemas.requests import RegisterRequest
from .answers import registration_json
from .inputs import measured_of, pairs_of, registration_options_of
from .job import Done, Job


def answer_registration(asked: RegisterRequest, job: Job) -> Done:
    """Lay scan segments on the map segments that they are known to belong to.

    Raises
    ------
    InputError
        When they are not what the library takes.
    """
    map_segments = Segments.from_array(asked.map.segments, argument="map.segments")
    scan = measured_of(asked.scan)
    pairs = pairs_of(asked, len(map_segments), len(scan))
    options = registration_options_of(asked)
    job.watch.lap("decode")
    sigma = asked.map.sigma
    if sigma is None:
        result = register_estimating(map_segments, scan, pairs, options)
    else:
        result = register(map_segments, scan, pairs, sigma, options)
    job.watch.lap("search")
    return job.done(registration_json(result, pairs))
