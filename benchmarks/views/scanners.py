"""Several scanners at once, and one that moves while it scans."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from association import MapIndex, Scan, View, assemble
from linefix.ranges import ranges_scan
from registration import RigidTransform, Segments
from simulation import Scanner, SimulationError, scan
from vectorization import LaserScan, Motion

from ..queries import floor_plans
from ..table import Row, at_least, mean, quantile
from ..worlds import free_place
from ..worlds.changes import clutter
from .trials import NEAR, TURNED, Trial, tried, usable_share, wrong_share

PLAN_NEAR, PLAN_TURNED = 0.1, 1.0
SPEED, TURNING = 1.0, math.radians(90.0)  # m/s, rad/s
TURN_TIME = 0.1  # s a scan


def _plans(quick: int) -> Iterator[tuple[MapIndex, Segments, int]]:
    plans = floor_plans()
    keys = sorted({query.map for query in plans.queries})
    for number, key in enumerate(keys[:: max(1, quick)]):
        yield plans.index(key), plans.maps[key], number


def two_scanners(quick: int) -> list[Row]:
    """Scan plans half hidden by people with one scanner of 360 degrees, and with two of 270 on opposite corners."""
    mounts = (RigidTransform(0.3, 0.2, math.pi / 4), RigidTransform(-0.3, -0.2, -0.75 * math.pi))
    around, corner = Scanner.over(math.tau, 1080), Scanner.over(1.5 * math.pi, 811)
    one, two = [], []
    for index, walls, number in _plans(quick):
        rng = np.random.default_rng([number, 11])
        try:
            pose = free_place(walls, rng, 0.6)
        except SimulationError:
            continue
        people = clutter(walls, pose, around, 0.5, rng)
        if people is None:
            continue
        scene = Segments.from_array(np.vstack([walls.endpoints, people[0]]))
        one.append(tried(index, _looked(scene, pose, around, rng), pose, PLAN_NEAR, PLAN_TURNED))
        seen = [View(_looked(scene, pose.compose(at), corner, rng), at) for at in mounts]
        two.append(tried(index, assemble(seen), pose, PLAN_NEAR, PLAN_TURNED))
    alone = mean(t.usable for t in one)
    return [
        usable_share("one scanner of 360 degrees", one), wrong_share(one),
        usable_share("two of 270 degrees", two, alone), wrong_share(two),
        Row("median ms of one, of two", f"{quantile([t.ms for t in one], 0.5):.2f}, "
            f"{quantile([t.ms for t in two], 0.5):.2f}"),
    ]  # fmt: skip


def _looked(scene: Segments, pose: RigidTransform, scanner: Scanner, rng: np.random.Generator) -> Scan:
    ranges = scan(scene, pose, scanner, rng).ranges
    return ranges_scan(LaserScan(scanner.angle_min, scanner.angle_increment, ranges, 0.0, scanner.range_max))


def turning(quick: int) -> list[Row]:
    """Scan plans standing still and while turning and driving; told of the motion, and not told."""
    scanner = Scanner.over(1.5 * math.pi, 541)
    still: list[Trial] = []
    told: list[Trial] = []
    untold: list[Trial] = []
    step = TURN_TIME / math.tau * scanner.angle_increment
    motion = Motion(step, SPEED, 0.0, TURNING)
    for index, walls, number in _plans(2 * quick):
        rng = np.random.default_rng([number, 13])
        try:
            pose = free_place(walls, rng, 0.6)
        except SimulationError:
            continue
        first = tried(index, _looked(walls, pose, scanner, rng), pose, PLAN_NEAR, PLAN_TURNED)
        still.append(first)
        if not first.usable:
            continue
        ranges = _moving_ranges(walls, pose, scanner, motion, rng)
        with_twist, without = (
            ranges_scan(LaserScan(scanner.angle_min, scanner.angle_increment, ranges, 0.0, scanner.range_max, by))
            for by in (motion, None)
        )
        told.append(tried(index, with_twist, pose, PLAN_NEAR, PLAN_TURNED))
        x, y, theta = motion.places(scanner.beams)[scanner.beams // 2].tolist()
        untold.append(tried(index, without, pose.compose(RigidTransform(x, y, theta)), NEAR, TURNED))
    return [
        usable_share("standing still", still),
        usable_share("of those, 90 degrees/s and 1 m/s, with twist", told, 0.8), wrong_share(told),
        at_least("  right first", mean(t.right for t in told), 0.95),
        usable_share("  without, and where it was in the middle of the scan", untold), wrong_share(untold),
    ]  # fmt: skip


def _moving_ranges(
    walls: Segments, pose: RigidTransform, scanner: Scanner, motion: Motion, rng: np.random.Generator
) -> np.ndarray:
    """Return what a scanner reads that moves: each beam from where it then is."""
    ranges = np.empty(scanner.beams)
    for k, (x, y, theta) in enumerate(motion.places(scanner.beams).tolist()):
        at = pose.compose(RigidTransform(x, y, theta))
        beam = Scanner(1, float(scanner.angles[k]), scanner.angle_increment, 0.0, scanner.range_max, scanner.sigma)
        ranges[k] = scan(walls, at, beam, rng).ranges[0]
    return ranges
