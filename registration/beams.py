"""Single range measurements, as they are before lines are made of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .layout import Floats
from .transform import RigidTransform

_MIRROR = np.array([1.0, -1.0])


@dataclass(frozen=True, slots=True)
class Beams:
    """Single range measurements, evidence for and against a pose.

    Attributes
    ----------
    angles : (m,) radians in the scan frame
    ranges : (m,) metres; inf where the beam came back from nothing within `range_max`; nan where nothing is known
    range_max : float
        Metres; how far a beam without return is known to be free; inf where the scanner does not say.
    origins : (m, 2) or None
        Origin of each beam in the scan frame, metres; None: at the scan's viewpoint.
    """

    angles: Floats
    ranges: Floats
    range_max: float
    origins: Floats | None = None

    def mirrored(self) -> Beams:
        """Return them with left and right exchanged, in reverse order."""
        origins = None if self.origins is None else np.ascontiguousarray(self.origins[::-1] * _MIRROR)
        angles, ranges = np.ascontiguousarray(-self.angles[::-1]), np.ascontiguousarray(self.ranges[::-1])
        return Beams(angles, ranges, self.range_max, origins)

    def scaled(self, factor: float) -> Beams:
        """Return them with all lengths multiplied."""
        origins = None if self.origins is None else self.origins * factor
        return Beams(self.angles, self.ranges * factor, self.range_max * factor, origins)

    def moved(self, by: RigidTransform, viewpoint: tuple[float, float]) -> Beams:
        """Return them in another frame; those without an origin of their own begin at `viewpoint`."""
        origins = np.tile(np.asarray(viewpoint), (len(self.angles), 1)) if self.origins is None else self.origins
        return Beams(self.angles + by.theta, self.ranges, self.range_max, by.apply(origins))
