"""Simulated scans at poses of a map, and whether such a scan fits another pose of the map as well."""

from __future__ import annotations

import itertools
import math
from collections.abc import Generator, Iterable, Iterator
from dataclasses import dataclass
from typing import TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from association import AssociationResult, Deadline, Scan
from registration import InputError, RigidTransform, Segments, wrap_angle
from simulation import Scanner, scan
from vectorization import LaserScan, VectorizationOptions, vectorize

MOST_BEAMS = 20_000
LEAST_SIGMA, MOST_SIGMA = 1e-6, 10.0  # m; accepted values of the sigma of ranges
ALL_ROUND = math.tau - 0.01  # rad; a full turn, and what people write for one
HEADINGS = 4  # of a scanner that does not see all round, from each place
SAME_PLACE, SAME_HEADING = 0.5, 0.5  # m, rad; a pose that is nearer to another one is the same
T = TypeVar("T")
# One search at each step; between steps others may have their turn.
Steps: TypeAlias = Generator[None, None, T]


class AnalysisError(InputError):
    """A property of the robot or of its places is out of range."""


@dataclass(frozen=True, slots=True)
class Robot:
    """The scanner of a robot. Default: a full turn, 720 beams, 20 m, 2 cm noise.

    Attributes
    ----------
    fov : float
        Field of view about straight ahead, radians, above 0 and at most a full turn.
    beams : int
        Over the field of view, 8 to 20,000.
    range_max : float
        Metres, 0.5 to 1,000.
    sigma : float
        Standard deviation of the ranges, metres, 1e-6 to 10.

    Raises
    ------
    AnalysisError
        When a value is out of range.
    """

    fov: float = math.tau
    beams: int = 720
    range_max: float = 20.0
    sigma: float = 0.02

    def __post_init__(self) -> None:
        checks = [
            ("fov", 0.0 < self.fov <= math.tau + 1e-3, "radians above 0, at most a full turn"),
            ("beams", 8 <= self.beams <= MOST_BEAMS, f"a number from 8 to {MOST_BEAMS}"),
            ("range_max", 0.5 <= self.range_max <= 1000.0, "metres from 0.5 to 1000"),
            ("sigma", LEAST_SIGMA <= self.sigma <= MOST_SIGMA, f"metres from {LEAST_SIGMA:g} to {MOST_SIGMA:g}"),
        ]
        for argument, good, what in checks:
            if not good:
                raise AnalysisError(f"expected {what}, found {getattr(self, argument)!r}", argument=f"laser.{argument}")

    @property
    def scanner(self) -> Scanner:
        """The scanner that it carries."""
        return Scanner.over(
            math.tau if self.fov >= ALL_ROUND else self.fov, self.beams, range_max=self.range_max, sigma=self.sigma
        )

    @property
    def headings(self) -> tuple[float, ...]:
        """Headings at each place, radians: a single one for a scanner that sees a full turn."""
        count = 1 if self.fov >= ALL_ROUND else HEADINGS
        return tuple(math.remainder(k * math.tau / count, math.tau) for k in range(count))


@dataclass(frozen=True, slots=True)
class Seen:
    """A simulated scan.

    Attributes
    ----------
    scan : Scan
        With its beams, as a robot sends it.
    hits : (k,)
        Indices of the map segments that it shows.
    """

    scan: Scan
    hits: NDArray[np.int64]


def look(segments: Segments, pose: RigidTransform, robot: Robot, rng: np.random.Generator) -> Seen:
    """Simulate the scan of a robot at a pose of a map, map_from_scan; `rng` draws the noise."""
    scanner = robot.scanner
    found = scan(segments, pose, scanner, rng)
    laser = LaserScan(scanner.angle_min, scanner.angle_increment, found.ranges, 0.0, scanner.range_max)
    cut = vectorize(laser, VectorizationOptions(sigma=robot.sigma))
    return Seen(Scan(cut.measured, (0.0, 0.0), cut.beams), np.unique(found.hits[found.hits >= 0]))


def similar_pose(result: AssociationResult, pose: RigidTransform) -> RigidTransform | None:
    """Return another pose that explains a scan taken at `pose` about as well; None where there is none.

    It is an alternative, or the answer itself, however certain that is.
    """
    if not is_elsewhere(result, pose) and all(reason.code != "similar_place" for reason in result.reasons):
        return None
    poses = [result.pose, *(one.pose for one in result.alternatives)]
    return next((one for one in poses if one is not None and not is_same(one, pose)), None)


def is_elsewhere(result: AssociationResult, pose: RigidTransform) -> bool:
    """Return whether an answer is usable and yet not the pose where the scan was taken."""
    return result.usable and result.pose is not None and not is_same(result.pose, pose)


def is_same(found: RigidTransform, pose: RigidTransform) -> bool:
    """Return whether two poses are of the same place."""
    away = math.hypot(found.x - pose.x, found.y - pose.y)
    return away < SAME_PLACE and abs(wrap_angle(found.theta - pose.theta)) < SAME_HEADING


def in_time(items: Iterable[T], deadline: Deadline) -> Iterator[T]:
    """Yield items until the deadline passes."""
    return itertools.takewhile(lambda _: not deadline.passed, items)


def finished(steps: Steps[T]) -> T:
    """Take all steps, and return their result."""
    while True:
        try:
            next(steps)
        except StopIteration as done:
            result: T = done.value
            return result
