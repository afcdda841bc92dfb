"""What a caller can ask of a search, and what is known before it."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from registration import MeasuredSegments, RigidTransform

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Beams:
    """Single range measurements from one place, evidence for and against a pose.

    Attributes
    ----------
    angles : (m,) radians in the scan frame
    ranges : (m,) metres; inf where the beam came back from nothing within `range_max`; nan where nothing is known
    range_max : float
        Metres; how far a beam without return is known to be free.
    """

    angles: Floats
    ranges: Floats
    range_max: float


@dataclass(frozen=True, slots=True)
class Scan:
    """What the robot saw, in the sensor's frame.

    Attributes
    ----------
    measured : MeasuredSegments
    viewpoint : (float, float) or None
        Where the sensor stood, metres; None when the segments were not seen from one place, then lines of sight are no
        evidence.
    beams : Beams or None
        The raw ranges, where the scan came as such; they start at `viewpoint`.
    """

    measured: MeasuredSegments
    viewpoint: tuple[float, float] | None = (0.0, 0.0)
    beams: Beams | None = None


@dataclass(frozen=True, slots=True)
class SoftPrior:
    """A Gaussian over the pose: it scores, and is never fused into pose or covariance.

    Attributes
    ----------
    pose : RigidTransform
        map_from_scan.
    covariance : (3, 3)
        Of additive (x, y, theta) in the map frame; m^2, m rad, rad^2; positive definite.
    """

    pose: RigidTransform
    covariance: Floats


@dataclass(frozen=True, slots=True)
class HardPrior:
    """A window that the answer must lie in: `radius` metres and `angle` radians around `pose`."""

    pose: RigidTransform
    radius: float
    angle: float


Prior = SoftPrior | HardPrior


@dataclass(frozen=True, slots=True)
class AssociationOptions:
    """How to search.

    Attributes
    ----------
    max_alternatives : int
        How many other poses to report at most.
    confidence : float
        The chance wanted of not having missed a better consensus set, below 1.
    exhaustive : bool
        Go through all bases whatever the confidence.
    seed : int
        Of the choice among equally good bases.
    oriented : bool
        Whether directions mean anything.
    offset_tolerance : float or None
        Metres; gate on the distance of a scan segment's midpoint from its map line. None: from the sigmas.
    angle_tolerance : float or None
        Radians; gate on the angle between them. None: from the sigmas.
    min_overlap : float
        Share of a scan segment's length that must lie on the map, 0 to 1.
    """

    max_alternatives: int = 5
    confidence: float = 0.9999
    exhaustive: bool = False
    seed: int = 0
    oriented: bool = True
    offset_tolerance: float | None = None
    angle_tolerance: float | None = None
    min_overlap: float = 0.5


class CancelledError(Exception):
    """The search was told to stop by `Deadline.cancel`; there is no answer."""


@dataclass(slots=True)
class Deadline:
    """A cooperative end of the search: a time, a flag that another thread sets, or both.

    Attributes
    ----------
    at : float or None
        `time.monotonic()` seconds.
    """

    at: float | None = None
    _cancelled: bool = field(default=False, init=False)

    def cancel(self) -> None:
        """Make the search give up soon; safe from any thread."""
        self._cancelled = True

    @property
    def cancelled(self) -> bool:
        """Whether `cancel` was called."""
        return self._cancelled

    @property
    def passed(self) -> bool:
        """Whether the search has to end."""
        return self._cancelled or (self.at is not None and time.monotonic() >= self.at)
