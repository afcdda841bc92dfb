"""Registrations: the pose from known correspondences."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linefix.answers import registration_json
from linefix.documents.encoding import encode_list
from linefix.documents.requests import RegisterRequest
from registration import (
    MeasuredSegments,
    RegistrationOptions,
    RegistrationResult,
    Segments,
    register,
    register_estimating,
)

from .inputs import measured_of, pairs_of, registration_options_of
from .job import Done, Job


@dataclass(frozen=True, slots=True)
class KnownPairs:
    """A scan and a map whose correspondences are known.

    Attributes
    ----------
    map, scan : Segments, MeasuredSegments
    pairs : (k, 2)
        Indices of scan and map segment.
    sigma : float or None
        Standard deviation of the map's lines, metres; None: estimated.
    options : RegistrationOptions
    """

    map: Segments
    scan: MeasuredSegments
    pairs: NDArray[np.intp]
    sigma: float | None
    options: RegistrationOptions

    @classmethod
    def of(cls, asked: RegisterRequest) -> KnownPairs:
        """Read a request; raises `InputError` where the library refuses it."""
        segments, scan = Segments.from_array(asked.map.segments, argument="map.segments"), measured_of(asked.scan)
        pairs = pairs_of(asked, len(segments), len(scan))
        return cls(segments, scan, pairs, asked.map.sigma, registration_options_of(asked))

    def register(self) -> RegistrationResult:
        """Return the pose; raises `InputError` where the library refuses the pairs."""
        if self.sigma is None:
            return register_estimating(self.map, self.scan, self.pairs, self.options)
        return register(self.map, self.scan, self.pairs, self.sigma, self.options)


def answer_registration(asked: RegisterRequest, job: Job) -> Done:
    """Lay scan segments on the map segments that they are known to belong to; raises `InputError`."""
    known = KnownPairs.of(asked)
    job.watch.lap("decode")
    result = known.register()
    job.watch.lap("search")
    return job.done(registration_json(result, known.pairs, encode_list))
