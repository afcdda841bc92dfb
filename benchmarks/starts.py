"""Starts of robots: from each scan of a drive on, when a pose counts as agreed, and whether it is right.

Drives are those of the public logs, and others that are drawn in 40 buildings whose furniture has been moved since the
map was made. Each scan is searched once, alone; a start at each scan of a drive goes on from there. Odometry has
errors that are drawn.

``python -m benchmarks starts``
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

import linefix
from registration import IDENTITY, InputError, RigidTransform, Segments, wrap_angle
from ros2.agreement import Agreement, Event, Observation
from ros2.searching import OPTIONS, observation_of
from simulation import Scanner, scan

from .outcomes import progress
from .queries import logs
from .ranges import Log
from .table import Row, at_most, print_rows, quantile
from .worlds.buildings import FAMILIES
from .worlds.changes import rearranged
from .worlds.places import free_place, is_free

SECOND = 1_000_000_000
BUILDINGS = 40
SCANS = 200  # of a drive in a drawn building
STEP = 0.25  # m, and
TURN = math.radians(15.0)  # rad between scans
PERIOD = SECOND // 2  # ns between them
CLEARANCE = 0.35  # m
SLIP, SLIP_ANGLE, SLIP_ANGLE_PER_METRE = 0.03, 0.03, 0.01  # of the distance, of the angle, rad/m; standard deviations
RIGHT_DISTANCE, RIGHT_ANGLE = 0.3, 3.0  # m and degrees in a drawn building
MOST_SCANS = 150  # of a start
AGREE = 3  # scans, as `linefix ros2` requires by default
STARTS_OF_A_WRONG_ONE = 5000  # starts with at most one wrong pose
WIDE = Scanner.over(1.5 * math.pi, 720, range_min=0.05, range_max=25.0, sigma=0.015)
NARROW = Scanner.over(math.radians(100.0), 160, range_min=0.05, range_max=8.0, sigma=0.03)


@dataclass(frozen=True, slots=True)
class Drive:
    """The results of the scans of a drive, with odometry.

    Attributes
    ----------
    name : str
    scans : sequence of Observation
    truths : sequence of RigidTransform
        map_from_base.
    distance, angle : float
        Metres and degrees that a pose may be off.
    """

    name: str
    scans: Sequence[Observation]
    truths: Sequence[RigidTransform]
    distance: float
    angle: float

    def right(self, k: int) -> bool:
        """Return whether the pose of a scan is right."""
        pose, truth = self.scans[k].pose, self.truths[k]
        if pose is None:
            return False
        near = math.hypot(pose.x - truth.x, pose.y - truth.y) < self.distance
        return near and abs(math.degrees(wrap_angle(pose.theta - truth.theta))) < self.angle


@dataclass(frozen=True, slots=True)
class Start:
    """The result of a start: whether a pose was agreed, was right, and after how many seconds and metres."""

    agreed: bool
    right: bool
    seconds: float
    metres: float


def observe(index: linefix.MapIndex, laser: linefix.LaserScan, stamp: int) -> Observation:
    """Search a scan alone."""
    try:
        answer = linefix.locate(index, laser, options=OPTIONS)
    except InputError:
        return Observation(stamp)
    return observation_of(answer, None, stamp)


def with_odometry(
    scans: Sequence[Observation], truths: Sequence[RigidTransform], rng: np.random.Generator
) -> list[Observation]:
    """Return scans with odometry: the true steps, with errors that grow with them."""
    at = IDENTITY
    out = []
    for k, one in enumerate(scans):
        if k:
            step = truths[k - 1].inverse().compose(truths[k])
            metres = math.hypot(step.x, step.y)
            angle = SLIP_ANGLE * abs(step.theta) + SLIP_ANGLE_PER_METRE * metres
            slip = rng.normal(0.0, 1.0, 3) * [SLIP * metres, SLIP * metres, angle]
            at = at.compose(RigidTransform(step.x + slip[0], step.y + slip[1], step.theta + slip[2]))
        out.append(replace(one, odometry=at))
    return out


def logged_drives(quick: int) -> Iterator[Drive]:
    """Drive along the public logs."""
    for collection in logs(1):
        log, index = Log.load(collection.name), collection.index((collection.name, collection.name))
        queries = sorted(collection.queries, key=lambda one: one.number)[: len(collection.queries) // quick]
        scans = []
        for k, query in enumerate(queries):
            scans.append(observe(index, log.laser(query.number), (k + 1) * PERIOD))
            progress(f"{collection.name}, starts", k + 1, len(queries))
        truths = [query.pose for query in queries]
        rng = np.random.default_rng(zlib.crc32(collection.name.encode()))
        yield Drive(collection.name, with_odometry(scans, truths, rng), truths, collection.distance, collection.angle)


def drawn_drives(quick: int, scanner: Scanner = WIDE) -> Iterator[Drive]:
    """Drive through buildings that are drawn."""
    names = list(FAMILIES)
    for number in range(max(1, BUILDINGS // quick)):
        family = names[number % len(names)]
        rng = np.random.default_rng([zlib.crc32(family.encode()), number])
        building = FAMILIES[family].draw(rng).build(rng)
        standing = rearranged(building, rng).segments
        index = linefix.index_map(building.segments)
        truths = list(way(standing, rng))
        scans = []
        for k, truth in enumerate(truths):
            ranges = scan(standing, truth, scanner, rng).ranges
            laser = linefix.LaserScan(
                scanner.angle_min, scanner.angle_increment, ranges, scanner.range_min, scanner.range_max
            )
            scans.append(observe(index, laser, (k + 1) * PERIOD))
        progress("buildings, starts", number + 1, max(1, BUILDINGS // quick))
        yield Drive(family, with_odometry(scans, truths, rng), truths, RIGHT_DISTANCE, RIGHT_ANGLE)


def way(standing: Segments, rng: np.random.Generator) -> Iterator[RigidTransform]:
    """Drive straight on as far as there is room, turn, and drive on."""
    at = free_place(standing, rng, CLEARANCE)
    turning = 0.0
    for _ in range(SCANS):
        yield at
        ahead = at.compose(RigidTransform(STEP, 0.0, 0.0))
        if abs(turning) < 0.5 * TURN and is_free(standing, ahead.x, ahead.y, CLEARANCE) and rng.random() > 0.03:
            at = ahead
            continue
        if abs(turning) < 0.5 * TURN:
            turning = float(rng.uniform(-math.pi, math.pi))
        step = math.copysign(min(TURN, abs(turning)), turning)
        at, turning = at.compose(RigidTransform(0.0, 0.0, step)), turning - step


def start(drive: Drive, begin: int, needed: int) -> Start:
    """Start a robot at a scan of a drive."""
    agreement, metres = Agreement(needed), 0.0
    for k in range(begin, min(len(drive.scans), begin + MOST_SCANS)):
        if k > begin:
            metres += math.hypot(*(np.subtract(_place(drive.truths[k]), _place(drive.truths[k - 1]))))
        if agreement.take(drive.scans[k]) is Event.AGREED:
            seconds = (drive.scans[k].stamp - drive.scans[begin].stamp) / SECOND
            return Start(True, drive.right(k), seconds, metres)
    return Start(False, False, math.nan, math.nan)


def _place(pose: RigidTransform) -> tuple[float, float]:
    return pose.x, pose.y


def starts(quick: int) -> list[Row]:
    """Print the table, and each wrong start with three scans."""
    rows = []
    measured = (
        ("logs", list(logged_drives(quick))),
        ("buildings, 270 degrees", list(drawn_drives(quick))),
        ("buildings, 100 degrees", list(drawn_drives(quick, NARROW))),
    )
    for title, drives in measured:
        rows.append(Row(f"{title}: starts", str(sum(len(drive.scans) for drive in drives))))
        for needed in (1, 2, AGREE, 5):
            rows += _rows(title, drives, needed)
    print_rows("Starts: from each scan on, until a pose is agreed", rows)
    return rows


def _rows(title: str, drives: Sequence[Drive], needed: int) -> list[Row]:
    found = [
        (number, k, start(drive, k, needed)) for number, drive in enumerate(drives) for k in range(len(drive.scans))
    ]
    agreed = [one for _, _, one in found if one.agreed]
    wrong = [(number, k) for number, k, one in found if one.agreed and not one.right]
    if needed == AGREE:
        for number, k in wrong:
            print(f"wrong: {title}, drive {number} ({drives[number].name}) from scan {k}")
    metres, scans = [one.metres for one in agreed], [one.seconds * SECOND / PERIOD + 1.0 for one in agreed]
    goal = len(found) / STARTS_OF_A_WRONG_ONE if needed == AGREE else None
    name = f"{title}, {needed} scan{'s agree' if needed > 1 else ''}"
    return [
        at_most(f"{name}: wrong poses", len(wrong), goal, form="d"),
        Row(f"{name}: agreed", f"{100.0 * len(agreed) / len(found):.1f} %"),
        Row(f"{name}: m driven, median", f"{quantile(metres, 0.5):.1f}"),
        Row(f"{name}: m driven, p95", f"{quantile(metres, 0.95):.1f}"),
        Row(f"{name}: scans, median", f"{quantile(scans, 0.5):.0f}"),
        Row(f"{name}: scans, p95", f"{quantile(scans, 0.95):.0f}"),
    ]
