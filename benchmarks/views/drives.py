"""Drives: what was seen along the last metres, with the steps between as odometry has them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from association import Scan, View, assemble
from linefix.ranges import ranges_scan
from registration import IDENTITY, RigidTransform, Segments
from simulation import Scanner, scan
from vectorization import LaserScan

from ..collection import Query
from ..ranges import Log
from ..table import mean
from ..worlds import CONDITIONS, Case
from ..worlds.conditions import Stranger
from ..worlds.measured.outcomes import share_that_reads
from ..worlds.measured.tables import TOLD
from ..worlds.places import is_free

DRIFT_DISTANCE = 0.02  # of a metre, and
DRIFT_ANGLE = math.radians(1.0)  # rad; standard deviations after a metre, of a random walk
MOST_STEPS = 8  # views before the last one
LEAST_STEP = 0.5  # m
LONGEST_STEP = 3.0  # m; where a log jumps farther there is no drive
TOUCHING = 1e-6  # m; a beam that reads the same in two scenes meets the same wall


@dataclass(frozen=True, slots=True)
class Look:
    """The scan of a place, and the pose of the place: in the map, or in the building.

    Attributes
    ----------
    scan : Scan
    pose : RigidTransform
    ranges : (m,) metres, or None if they are not compared with a map
    """

    scan: Scan
    pose: RigidTransform
    ranges: np.ndarray | None = None


def could_be_told(looks: Sequence[Look], scanner: Scanner, shown: Segments, pose: RigidTransform) -> bool:
    """Tell whether a drive speaks against a pose of its last place: some beams do not read what the map shows."""
    here = looks[0].pose.inverse()
    shares = [
        share_that_reads(shown, scanner, look.ranges, pose.compose(here.compose(look.pose)))
        for look in looks
        if look.ranges is not None
    ]
    return mean(shares) < TOLD


def drive(looks: Sequence[Look], rng: np.random.Generator) -> Scan:
    """Put looks together, the latest first, by steps on which drift is put; the scan's frame is that of the latest."""
    views, at = [View(looks[0].scan)], IDENTITY
    for k in range(1, len(looks)):
        step = looks[k - 1].pose.inverse().compose(looks[k].pose)
        far = max(0.01, math.hypot(step.x, step.y))
        sigmas = np.array([DRIFT_DISTANCE, DRIFT_DISTANCE, DRIFT_ANGLE]) * math.sqrt(far)
        x, y, theta = (rng.normal(size=3) * sigmas).tolist()
        at = at.compose(RigidTransform(step.x + x, step.y + y, step.theta + theta))
        views.append(View(looks[k].scan, at, np.diag(sigmas**2), k - 1))
    return assemble(views)


def before(log: Log, number: int, length: float) -> list[int]:
    """Return the scans of a log to look at, the latest first, over so many metres before it.

    Of those that no map was made of: the numbers are odd, as is that of a query.
    """
    spacing, chosen, gone, since = max(LEAST_STEP, length / MOST_STEPS), [number], 0.0, 0.0
    for k in range(number - 2, -1, -2):
        step = float(np.hypot(*(log.poses[k, :2] - log.poses[k + 2, :2])))
        gone, since = gone + step, since + step
        if step > LONGEST_STEP or gone > length + spacing:
            break
        if since >= spacing:
            chosen.append(k)
            since = 0.0
    return chosen


def looks_of(log: Log, numbers: Sequence[int]) -> list[Look]:
    """Return scans of a log, and their poses."""
    return [Look(ranges_scan(log.laser(k)), RigidTransform(*(float(v) for v in log.poses[k]))) for k in numbers]


def log_drive(log: Log, query: Query, length: float) -> Scan:
    """Return a query with the views of the metres before it; the same drift each time."""
    numbers = before(log, query.number, length)
    return drive(looks_of(log, numbers), np.random.default_rng([query.number, round(10 * length)]))


def way_back(scene: Segments, pose: RigidTransform, length: float, rng: np.random.Generator) -> list[RigidTransform]:
    """Return places on a straight way to a pose, it first, as far back as there is room, up to `length` metres."""
    ways: list[list[RigidTransform]] = []
    for turn in rng.uniform(-math.pi, math.pi, 12).tolist():
        way = [pose]
        for gone in np.arange(1.0, length + 1e-9, 1.0).tolist():
            x, y = pose.x + gone * math.cos(turn), pose.y + gone * math.sin(turn)
            if not is_free(scene, x, y, 0.3):
                break
            way.append(RigidTransform(x, y, pose.theta + 0.05 * gone))
        ways.append(way)
    return max(ways, key=len)


def world_looks(case: Case, length: float) -> list[Look]:
    """Return what the scanner of a case sees on its way; its own scan first.

    If the map is of another part of the building, the way ends before any of that is seen.
    """
    rng = np.random.default_rng([case.number, 7])
    looks = []
    for k, at in enumerate(way_back(case.scene, case.pose, length, rng)):
        if CONDITIONS[case.condition].stranger is Stranger.UNMAPPED and _sees(case, at):
            break
        ranges = case.ranges if k == 0 else scan(case.scene, at, case.scanner, rng).ranges
        looks.append(look(case.scanner, ranges, at))
    return looks


def look(scanner: Scanner, ranges: np.ndarray, at: RigidTransform) -> Look:
    """Return what a scanner reports as a look."""
    return Look(ranges_scan(laser_of(scanner, ranges), scanner.sigma), at, ranges)


def _sees(case: Case, at: RigidTransform) -> bool:
    """Tell whether anything of what the map shows is seen from a place in the building."""
    exact = replace(case.scanner, sigma=0.0)
    standing, shown = (scan(segments, at, exact) for segments in (case.scene, case.shown))
    met = (shown.hits >= 0) & (standing.hits >= 0)
    return bool((np.abs(standing.true_ranges[met] - shown.true_ranges[met]) < TOUCHING).any())


def laser_of(scanner: Scanner, ranges: np.ndarray) -> LaserScan:
    """Return what a scanner reports."""
    return LaserScan(scanner.angle_min, scanner.angle_increment, ranges, scanner.range_min, scanner.range_max)
