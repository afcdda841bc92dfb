"""Options of the vectorizer."""

from __future__ import annotations

import math
from dataclasses import dataclass

from .errors import InvalidOptionError


@dataclass(frozen=True, slots=True)
class VectorizationOptions:
    """Resolution of the segments.

    Attributes
    ----------
    sigma : float or None
        Standard deviation of the ranges along the ray (of points without viewpoint: in every direction), metres,
        above 0 and at most 10. None: estimated from the scan.
    min_points : int
        Least number of points behind a segment, 3 to 1000.
    min_length : float
        Least length of a segment, metres, 1e-3 to 1e3.
    max_gap : float or None
        Metres, above 0; neighbouring points farther apart than this are never on one segment. None: what the angle
        between the beams and the range let a wall's points be apart decides alone.

    Raises
    ------
    InvalidOptionError
        When a value is out of range.
    """

    sigma: float | None = None
    min_points: int = 4
    min_length: float = 0.1
    max_gap: float | None = None

    def __post_init__(self) -> None:
        if self.sigma is not None and not 0.0 < self.sigma <= 10.0:
            raise InvalidOptionError(f"expected more than 0 and at most 10 m, found {self.sigma!r}", argument="sigma")
        if not 3 <= self.min_points <= 1000:
            raise InvalidOptionError(f"expected 3 to 1000, found {self.min_points!r}", argument="min_points")
        if not 1e-3 <= self.min_length <= 1e3:
            raise InvalidOptionError(f"expected 0.001 to 1000 m, found {self.min_length!r}", argument="min_length")
        if self.max_gap is not None and not (self.max_gap > 0.0 and math.isfinite(self.max_gap)):
            raise InvalidOptionError(f"expected more than 0 m, found {self.max_gap!r}", argument="max_gap")
