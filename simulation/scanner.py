"""A virtual laser scanner over a map of segments, with exact correspondences as truth."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import InputError, RigidTransform, Segments
from registration.layout import Floats
from registration.limits import MAX_ANGLE, MAX_BEAMS

from .kernels.casting import cast

Indices = NDArray[np.int64]


class SimulationError(InputError):
    """An argument of a scanner, a scan or a world is wrong: the one error of this package."""


@dataclass(frozen=True, slots=True)
class Scanner:
    """Properties of a scanner. The default has 1,080 beams over 360 degrees, 20 m range and 2 cm noise.

    Attributes
    ----------
    beams : int
        Number of beams, 1 to 100,000.
    angle_min : float
        Of the first beam in the scan frame, radians.
    angle_increment : float
        From beam to beam, radians; negative for a clockwise scan; all beams together at most one turn.
    range_min, range_max : float
        Metres; what lies nearer is reported as nan, what lies farther as inf.
    sigma : float
        Standard deviation of the ranges, metres, 0 for none.
    dropout : float
        Chance that a beam brings no return whatever it hits, 0 to 1; the range is inf, as a real scanner reports it.
    quantum : float
        Step to which ranges are rounded, metres, 0 for none.
    bias : float
        Bias of every range, metres: a scanner that measures too long or too short.
    saturated : bool
        True if a beam without return reads `range_max`, as some drivers report it, instead of inf.
    one_sided : bool
        True if a segment is seen from its left only and let through from its right. By default every segment stops
        every beam, and `SimulatedScan.facing` says from which side.

    Raises
    ------
    SimulationError
        When a value is out of range.
    """

    beams: int = 1080
    angle_min: float = -math.pi
    angle_increment: float = math.tau / 1080
    range_min: float = 0.0
    range_max: float = 20.0
    sigma: float = 0.02
    dropout: float = 0.0
    quantum: float = 0.0
    bias: float = 0.0
    saturated: bool = False
    one_sided: bool = False

    def __post_init__(self) -> None:
        checks = [
            ("beams", 1 <= self.beams <= MAX_BEAMS, f"from 1 to {MAX_BEAMS}"),
            ("angle_min", abs(self.angle_min) <= MAX_ANGLE, f"of at most {MAX_ANGLE:g} rad"),
            ("angle_increment", 0.0 < abs(self.angle_increment) * (self.beams - 1) <= math.tau * (1 + 1e-9)
             or (self.beams == 1 and 0.0 < abs(self.angle_increment) <= math.tau), "that makes at most one turn"),
            ("range_min", 0.0 <= self.range_min < math.inf, "from 0 up"),
            ("range_max", self.range_min < self.range_max < math.inf, "above range_min"),
            ("sigma", 0.0 <= self.sigma < math.inf, "from 0 up"),
            ("dropout", 0.0 <= self.dropout <= 1.0, "from 0 to 1"),
            ("quantum", 0.0 <= self.quantum < math.inf, "from 0 up"),
            ("bias", abs(self.bias) < math.inf, "of metres"),
        ]  # fmt: skip
        for argument, good, what in checks:
            if not good:
                raise SimulationError(f"expected a number {what}, found {getattr(self, argument)!r}", argument=argument)

    @classmethod
    def over(cls, field_of_view: float, beams: int, **others: float) -> Scanner:
        """Return a scanner that looks forward: `beams` of them evenly over `field_of_view` radians, ends included.

        A full turn leaves the last beam one step before the first. `others` are attributes of the class.
        """
        full = field_of_view >= math.tau - 1e-9
        step = field_of_view / (beams if full or beams == 1 else beams - 1)
        return cls(beams=beams, angle_min=-0.5 * field_of_view, angle_increment=step, **others)  # type: ignore[arg-type]

    @property
    def angles(self) -> Floats:
        """The beams' angles in the scan frame, ``(beams,)`` radians, not wrapped."""
        return self.angle_min + self.angle_increment * np.arange(self.beams, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class SimulatedScan:
    """A scan and its truth.

    Attributes
    ----------
    scanner : Scanner
    pose : RigidTransform
        The truth, map_from_scan.
    ranges : (m,) metres as measured; inf (`range_max` where the scanner is saturated) where nothing came back, nan
        nearer than `range_min`
    true_ranges : (m,) metres without noise, dropouts and limits; inf where the map is open
    hits : (m,) index of the map segment behind each range that was measured, -1 for none
    facing : (m,) whether that segment was hit from its left, its free side
    """

    scanner: Scanner
    pose: RigidTransform
    ranges: Floats
    true_ranges: Floats
    hits: Indices
    facing: NDArray[np.bool_]

    @property
    def angles(self) -> Floats:
        """The beams' angles in the scan frame, ``(m,)`` radians."""
        return self.scanner.angles

    @property
    def points(self) -> Floats:
        """The measured points in the scan frame, ``(k, 2)`` metres, beams without a range left out."""
        seen = np.isfinite(self.ranges)
        a = self.angles[seen]
        r: Floats = self.ranges[seen]
        return np.stack([r * np.cos(a), r * np.sin(a)], axis=1)


def scan(
    map: Segments,
    pose: RigidTransform,
    scanner: Scanner | None = None,
    rng: np.random.Generator | None = None,
) -> SimulatedScan:
    """Take a scan of a map.

    Parameters
    ----------
    map : Segments
        Metres in the map frame.
    pose : RigidTransform
        Pose of the scanner, map_from_scan. A segment whose line runs exactly through it is not seen.
    scanner : Scanner, optional
    rng : numpy.random.Generator, optional
        Of noise and dropouts; needed where the scanner has either.

    Returns
    -------
    SimulatedScan

    Raises
    ------
    SimulationError
        When the scanner is noisy and there is no `rng`.
    """
    scanner = scanner or Scanner()
    if rng is None and (scanner.sigma > 0.0 or scanner.dropout > 0.0):
        raise SimulationError("expected a numpy.random.Generator, for the scanner is noisy", argument="rng")
    angles = scanner.angles + pose.theta
    true_ranges, hits = cast(
        map.endpoints, pose.x, pose.y, angles[0], scanner.angle_increment, np.cos(angles), np.sin(angles),
        scanner.one_sided,
    )  # fmt: skip
    ranges = np.where(true_ranges <= scanner.range_max, true_ranges + scanner.bias, np.inf)
    if rng is not None and scanner.sigma > 0.0:
        ranges += rng.normal(0.0, scanner.sigma, scanner.beams)
    if scanner.quantum > 0.0:
        ranges = np.round(ranges / scanner.quantum) * scanner.quantum
    ranges[ranges > scanner.range_max] = np.inf
    ranges[ranges < scanner.range_min] = np.nan
    ranges[ranges <= 0.0] = np.nan
    if rng is not None and scanner.dropout > 0.0:
        ranges[rng.random(scanner.beams) < scanner.dropout] = np.inf
    hits = np.where(np.isfinite(ranges), hits, -1)
    if scanner.saturated:
        ranges[np.isinf(ranges)] = scanner.range_max
    return SimulatedScan(scanner, pose, ranges, true_ranges, hits, _facing(map, pose, hits))


def _facing(map: Segments, pose: RigidTransform, hits: Indices) -> NDArray[np.bool_]:
    if len(map) == 0:
        return np.zeros(len(hits), dtype=np.bool_)
    left = (map.midpoints[:, 0] - pose.x) * map.normals[:, 0] + (map.midpoints[:, 1] - pose.y) * map.normals[:, 1] < 0.0
    facing: NDArray[np.bool_] = left[hits] & (hits >= 0)
    return facing
