"""What a robot would know at a place: a scan taken there, searched in the map that it was taken in."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from association import (
    AssociationOptions,
    AssociationResult,
    Deadline,
    MapIndex,
    Scan,
    Status,
    associate,
)
from registration import RigidTransform, Segments, wrap_angle
from simulation import scan
from vectorization import LaserScan, VectorizationOptions, vectorize

from .robot import Robot
from .standing import Standing, is_free

SAME_PLACE, SAME_HEADING = 0.5, 0.5  # m, rad; nearer than that a pose is the one where the robot stood


@dataclass(frozen=True, slots=True)
class PlaceVerdict:
    """What a robot would know at a place.

    Attributes
    ----------
    number : int
        Of the pose in `Standing.poses`.
    pose : RigidTransform
        Where it stands, map_from_scan.
    status : Status
        Of the answer; ambiguous where that is another place, however sure the search was.
    usable : bool
        Whether the answer was usable, and this place.
    probability : float
        As answered, 0 to 1.
    look_alike : RigidTransform or None
        Another place that explains the scan about as well, or was taken for this one.
    unobservable : (float, float) or None
        Along which the position stays free; a unit vector in the map frame.
    reasons : tuple of str
        Codes of why it is not usable, the weightiest first.
    """

    number: int
    pose: RigidTransform
    status: Status
    usable: bool
    probability: float
    look_alike: RigidTransform | None
    unobservable: tuple[float, float] | None
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Analysis:
    """A map that is gone over; shared between threads.

    Attributes
    ----------
    index : MapIndex
        Where scans are searched.
    segments : Segments
        What the scanner sees: the map as sent.
    robot : Robot
    standing : Standing
    oriented : bool
        Whether directions mean something.
    seed : int
        Of the noise.
    """

    index: MapIndex
    segments: Segments
    robot: Robot
    standing: Standing
    oriented: bool = True
    seed: int = 0

    def look(self, number: int, deadline: Deadline | None = None) -> PlaceVerdict | None:
        """Take a scan at one of the poses and search it; None where a robot cannot stand there.

        Raises
        ------
        CancelledError
            When the deadline was cancelled.
        """
        pose = self.standing.pose(number)
        if not is_free(self.segments, pose, self.robot.range_max, oriented=self.oriented):
            return None
        options = AssociationOptions(oriented=self.oriented)
        return _verdict(number, pose, associate(self.index, self._scan(number, pose), None, options, deadline))

    def _scan(self, number: int, pose: RigidTransform) -> Scan:
        """Return what the robot would send from there; the noise of a place is the same whenever it is tried."""
        scanner = self.robot.scanner
        ranges = scan(self.segments, pose, scanner, np.random.default_rng((self.seed, number))).ranges
        laser = LaserScan(scanner.angle_min, scanner.angle_increment, ranges, 0.0, scanner.range_max)
        found = vectorize(laser, VectorizationOptions(sigma=self.robot.sigma))
        return Scan(found.measured, (0.0, 0.0), found.beams)


def _verdict(number: int, pose: RigidTransform, result: AssociationResult) -> PlaceVerdict:
    codes = tuple(reason.code for reason in result.reasons)
    other = None
    mistaken = result.usable and result.pose is not None and not _is_same(result.pose, pose)
    if mistaken or "twin" in codes:
        poses = [result.pose, *(one.pose for one in result.alternatives)]
        other = next((one for one in poses if one is not None and not _is_same(one, pose)), None)
    return PlaceVerdict(
        number=number,
        pose=pose,
        status=Status.AMBIGUOUS if mistaken else result.status,
        usable=result.usable and not mistaken,
        probability=result.probability,
        look_alike=other,
        unobservable=result.unobservable,
        reasons=("twin",) if mistaken else codes,
    )


def _is_same(found: RigidTransform, pose: RigidTransform) -> bool:
    away = math.hypot(found.x - pose.x, found.y - pose.y)
    return away < SAME_PLACE and abs(wrap_angle(found.theta - pose.theta)) < SAME_HEADING
