"""Scans as range finders give them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from registration.layout import Floats
from registration.limits import MAX_ANGLE, MAX_BEAMS, MAX_LENGTH, MIN_LENGTH

from .errors import InvalidScanError

MIN_INCREMENT = 1e-6  # rad; neighbouring beams closer than that are one


LONGEST_SCAN = 1.0  # s; slow scanners turn at 5 Hz, and a `time_increment` that makes more is in another unit
USUAL_SCAN = 0.2  # s; of a slow scanner, assumed in its place

MOST_TURN = 0.5  # of the step from beam to beam, that the sensor itself may turn meanwhile

# Greatest distance of angle_max from the last beam. Drivers set it to the end of the field of view and round the number
# of ranges down (LDS-01, neato, velodyne_laserscan), which makes less than two beams; filters cut ranges and leave it.
BEAMS_OFF = 2.0
ANGLE_OFF = math.radians(3.0)
ROUNDING = 1e-3  # of a beam, as float32 has it


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion of a sensor during a scan: a constant twist in its own frame.

    Attributes
    ----------
    time_increment : float
        From beam to beam, seconds.
    vx, vy : float
        m/s.
    omega : float
        rad/s.
    """

    time_increment: float
    vx: float
    vy: float
    omega: float

    def places(self, count: int) -> Floats:
        """Return where the sensor was at each of `count` beams, (count, 3) x, y, theta; the first is at the origin."""
        t = self.time_increment * np.arange(count, dtype=np.float64)
        turned = self.omega * t
        ahead = t * np.sinc(turned / math.pi)  # sin(omega t) / omega
        aside = t * np.sin(0.5 * turned) * np.sinc(0.5 * turned / math.pi)  # (1 - cos(omega t)) / omega
        return np.stack([self.vx * ahead - self.vy * aside, self.vx * aside + self.vy * ahead, turned], axis=1)


@dataclass(frozen=True, slots=True, init=False, eq=False)
class LaserScan:
    """Ranges over evenly spaced angles, as REP-117 has them.

    Attributes
    ----------
    angle_min : float
        Of the first beam, radians, counter-clockwise from the scan frame's x axis.
    angle_increment : float
        From beam to beam, radians, at least 1e-6; negative for a scanner that turns clockwise. All beams make at most a
        turn.
    ranges : (m,) metres
        inf where nothing came back; nan, or None in a list, where nothing is known; -inf where something was too near.
    range_min, range_max : float
        Metres. Ranges above `range_max` mean that nothing came back, those below `range_min` and those not above 0 that
        nothing is known; a `range_max` of inf lets any range up to 10 km stand.
    motion : Motion or None
        Of the sensor while it scanned; the scan frame is where it was at the first beam.

    Raises
    ------
    InvalidScanError
        When there are no numbers, too many, or the angles are no scan's.
    """

    angle_min: float
    angle_increment: float
    ranges: Floats = field(repr=False)
    range_min: float = 0.0
    range_max: float = math.inf
    motion: Motion | None = None

    def __init__(
        self,
        angle_min: float,
        angle_increment: float,
        ranges: ArrayLike,
        range_min: float = 0.0,
        range_max: float = math.inf,
        motion: Motion | None = None,
    ) -> None:
        values = _numbers(ranges)
        m = len(values)
        if not abs(angle_min) <= MAX_ANGLE:
            raise InvalidScanError(
                f"expected -{MAX_ANGLE:g} to {MAX_ANGLE:g} rad, found {angle_min!r}", argument="angle_min"
            )
        turn = abs(angle_increment) * max(1, m - 1)
        if not (abs(angle_increment) >= MIN_INCREMENT and turn <= math.tau * (1.0 + 1e-3)):
            raise InvalidScanError(
                f"expected radians, at least {MIN_INCREMENT:g} and at most one turn over {m} beams; "
                f"found {angle_increment!r}",
                argument="angle_increment",
            )
        if not 0.0 <= range_min < math.inf:
            raise InvalidScanError(f"expected at least 0 m, found {range_min!r}", argument="range_min")
        if not range_max > range_min:
            raise InvalidScanError(f"expected more than range_min, found {range_max!r}", argument="range_max")
        moved = 0.0 if motion is None else abs(motion.omega * motion.time_increment)
        if moved > MOST_TURN * abs(angle_increment):
            raise InvalidScanError(
                f"expected a sensor that rotates much slower than its beams, found {moved:.3g} rad from beam to beam; "
                "check omega (rad/s) and time_increment (s)",
                argument="twist",
            )
        object.__setattr__(self, "motion", motion)
        object.__setattr__(self, "angle_min", float(angle_min))
        object.__setattr__(self, "angle_increment", float(angle_increment))
        object.__setattr__(self, "ranges", values)
        object.__setattr__(self, "range_min", float(range_min))
        object.__setattr__(self, "range_max", float(range_max))

    @property
    def angles(self) -> Floats:
        """The beams' angles, ``(m,)`` radians, not wrapped."""
        return self.angle_min + self.angle_increment * np.arange(len(self.ranges), dtype=np.float64)

    @property
    def places(self) -> Floats:
        """Pose of the sensor at each beam, ``(m, 3)`` x, y, theta in the scan frame; metres and radians."""
        m = len(self.ranges)
        return np.zeros((m, 3)) if self.motion is None else self.motion.places(m)

    @property
    def cleaned(self) -> Floats:
        """The ranges with every beam without return at inf and every beam of which nothing is known at nan.

        Ranges shorter than the shortest segment are unknown, too.
        """
        r, least, most = self.ranges, max(self.range_min, MIN_LENGTH), min(self.range_max, MAX_LENGTH)
        cleaned = r.copy()
        np.putmask(cleaned, r > most, math.inf)
        np.putmask(cleaned, r < least, math.nan)
        return cleaned

    @property
    def beyond_limits(self) -> str | None:
        """What is wrong where ranges are finite, and none is valid; None elsewhere.

        A value that stands for no return repeats. Values that differ were measured.
        """
        found = self.ranges[np.isfinite(self.ranges)]
        if not len(found) or np.isfinite(self.cleaned).any():
            return None
        unit = ": they seem to be in another unit, such as millimetres; expected metres"
        return (
            f"between range_min {self.range_min:g} m and range_max {self.range_max:g} m, but around "
            f"{np.median(found):g} m{unit if 2 * len(np.unique(found)) > len(found) > 1 else ''}"
        )

    def points(self) -> Floats:
        """Return the measured points in the scan frame, ``(k, 2)`` metres, beams without a range left out."""
        r = self.cleaned
        seen = np.isfinite(r)
        places = self.places[seen]
        a = self.angles[seen] + places[:, 2]
        return places[:, :2] + np.stack([r[seen] * np.cos(a), r[seen] * np.sin(a)], axis=1)


def require_angle_max(angle_min: float, angle_max: float, angle_increment: float, beams: int) -> float:
    """Return how far `angle_max` of a LaserScan message is from its last beam, which increment and count determine.

    Parameters
    ----------
    angle_min, angle_max, angle_increment : float
        Of the first beam, of the last one, and from beam to beam; radians.
    beams : int

    Returns
    -------
    float
        Radians.

    Raises
    ------
    InvalidScanError
        When that is two beams or more and above 3 degrees, or the beams make more than a turn.
    """
    span = (beams - 1) * angle_increment
    off, two = abs(angle_max - angle_min - span), (BEAMS_OFF - ROUNDING) * abs(angle_increment)
    agree = angle_increment != 0.0 and off <= max(two, ANGLE_OFF)
    if agree and abs(span) <= math.tau + abs(angle_increment):
        return off
    told = f"angle_min {angle_min:g} rad, angle_max {angle_max:g} rad and angle_increment {angle_increment:g} rad"
    if agree:
        raise InvalidScanError(
            f"{told} over {beams} ranges exceed one turn; expected radians. Check for degrees in the driver",
            argument="angle_increment",
        )
    raise InvalidScanError(
        f"{told} contradict each other over {beams} ranges: expected angle_max near angle_min + {beams - 1} "
        f"angle_increment = {angle_min + span:g} rad; correct the driver",
        argument="angle_max",
    )


def _numbers(ranges: ArrayLike) -> Floats:
    try:
        # float64 turns None into nan, which is what it means.
        raw = np.asarray(ranges)
        values = np.array(raw, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InvalidScanError("expected an array of numbers", argument="ranges") from error
    strange = raw.dtype.kind == "O" and any(v is not None and type(v) not in (int, float) for v in raw.flat)
    if raw.dtype.kind not in "fiuO" or strange or values.ndim != 1:
        raise InvalidScanError(
            f"expected numbers of shape (m,), found {raw.dtype} of shape {raw.shape}", argument="ranges"
        )
    if len(values) > MAX_BEAMS:
        raise InvalidScanError(f"expected at most {MAX_BEAMS} beams, found {len(values)}", argument="ranges")
    values.setflags(write=False)
    return values
