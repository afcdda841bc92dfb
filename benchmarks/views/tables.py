"""The tables of ``python -m benchmarks views``."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from association import MapIndex, Scan, View, assemble, associate
from registration import RigidTransform, Segments
from simulation import FAMILIES, Scanner, draw_case, free_place, scan
from simulation.changes import clutter
from simulation.errors import SimulationError
from vectorization import LaserScan, Motion

from ..outcomes import OPTIONS, offset, progress
from ..queries import floor_plans, logs
from ..ranges import Log
from ..table import Row, at_least, at_most, mean, print_rows, quantile
from .drives import drive, log_drive, seen_by, world_looks

LENGTHS = (1.0, 2.0, 5.0, 10.0)  # m
USABLE = dict(zip(LENGTHS, (0.30, 0.50, 0.80, 0.90), strict=True))
NEAR, TURNED = 0.3, 3.0  # m and degrees; farther off is wrong
WORLDS = tuple(FAMILIES)
STRANGERS = ("sister", "other_type")
PLAN_NEAR, PLAN_TURNED = 0.1, 1.0
SPEED, TURNING = 1.0, math.radians(90.0)  # m/s, rad/s
TURN_TIME = 0.1  # s a scan


@dataclass(frozen=True, slots=True)
class Trial:
    """What came of a scan: usable, right, and the processor time, milliseconds."""

    usable: bool
    right: bool
    ms: float


def views(quick: int) -> list[Row]:
    """Print all tables, one in `quick` of everything, and return their rows."""
    rows: list[Row] = []
    for title, some in (
        ("Drives in logs", drives_in_logs),
        ("Drives in other buildings", drives_of_strangers),
        ("Two scanners", two_scanners),
        ("Motion within a scan", turning),
    ):
        found = some(quick)
        print_rows(title, found)
        rows += found
    return rows


def _tried(index: MapIndex, asked: Scan, truth: RigidTransform | None, near: float, turned: float) -> Trial:
    start = time.thread_time()
    result = associate(index, asked, None, OPTIONS)
    took = 1e3 * (time.thread_time() - start)
    right = False
    if truth is not None and result.pose is not None:
        distance, angle = offset(result.pose, truth)
        right = distance < near and angle < turned
    return Trial(result.usable, right, took)


def drives_in_logs(quick: int) -> list[Row]:
    """Search scans that are not usable alone with the views of the last metres; and in the map of the next log."""
    found: dict[float, list[Trial]] = {length: [] for length in (0.0, *LENGTHS)}
    away: dict[float, list[Trial]] = {length: [] for length in (0.0, *LENGTHS)}
    collections = logs(5 * quick)
    for k, collection in enumerate(collections):
        log, index = Log.load(collection.name), collection.index((collection.name, collection.name))
        other = collections[(k + 1) % len(collections)]
        elsewhere = other.index((other.name, other.name))
        for n, query in enumerate(collection.queries):
            alone = _tried(index, log_drive(log, query, 0.0), query.pose, NEAR, TURNED)
            found[0.0].append(alone)
            for length in LENGTHS:
                asked = log_drive(log, query, length)
                if not alone.usable:
                    found[length].append(_tried(index, asked, query.pose, NEAR, TURNED))
                if n % 2 == 0 and length >= 5.0:
                    away[length].append(_tried(elsewhere, asked, None, NEAR, TURNED))
            progress(f"{collection.name}, drives", n + 1, len(collection.queries))
    if not found[0.0]:
        return []
    rows = [_share("usable alone", found[0.0])]
    for length in LENGTHS:
        trials = found[length]
        rows.append(_share(f"not usable alone, with the views of the last {length:g} m", trials, USABLE[length]))
        rows.append(_wrong(trials))
    rows += [
        at_most(f"in another log's map, {length:g} m: usable of {len(trials)}", mean(t.usable for t in trials), 0.001)
        for length, trials in away.items()
        if trials
    ]
    one, many = (quantile([t.ms for t in found[length]], 0.5) for length in (0.0, 5.0))
    rows.append(Row("median ms of one, and of a drive of 5 m", f"{one:.2f}, {many:.2f}"))
    return rows


def _share(what: str, trials: list[Trial], goal: float | None = None) -> Row:
    return at_least(f"{what}: usable of {len(trials)}", mean(t.usable for t in trials), goal)


def _wrong(trials: list[Trial]) -> Row:
    usable = [t for t in trials if t.usable]
    wrong = sum(not t.right for t in usable)
    return at_most(f"  usable but wrong, % ({wrong} of {len(usable)})", 100.0 * wrong / max(1, len(usable)), 0.1)


def drives_of_strangers(quick: int) -> list[Row]:
    """Drive 5 m through drawn buildings and search the map of another: usable is wrong. And in their own, changed."""
    rows = []
    for condition in (*STRANGERS, "changed"):
        trials: dict[str, list[Trial]] = {"one view": [], "drive": []}
        for world in WORLDS:
            for number in range(max(1, 60 // quick)):
                try:
                    case = draw_case(world, condition, number)
                except (SimulationError, KeyError):
                    continue
                looks, index = world_looks(case, 5.0), MapIndex.build(case.map)
                asked = drive(looks, np.random.default_rng([number, 3]))
                trials["one view"].append(_tried(index, looks[0].scan, case.truth, NEAR, TURNED))
                trials["drive"].append(_tried(index, asked, case.truth, NEAR, TURNED))
                progress(f"{condition}, {world}", number + 1, max(1, 60 // quick))
        for form, some in trials.items():
            if not some:
                continue
            if condition in STRANGERS:
                usable = mean(t.usable for t in some)
                rows.append(at_most(f"{condition}, {form}: usable of {len(some)}", usable, 0.001, form=".4f"))
            else:
                rows += [_share(f"own map, changed, {form}", some), _wrong(some)]
    return rows


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
        one.append(_tried(index, _looked(scene, pose, around, rng), pose, PLAN_NEAR, PLAN_TURNED))
        seen = [View(_looked(scene, pose.compose(at), corner, rng), at) for at in mounts]
        two.append(_tried(index, assemble(seen), pose, PLAN_NEAR, PLAN_TURNED))
    alone = mean(t.usable for t in one)
    return [
        _share("one scanner of 360 degrees", one), _wrong(one),
        _share("two of 270 degrees", two, alone), _wrong(two),
        Row("median ms of one, of two", f"{quantile([t.ms for t in one], 0.5):.2f}, "
            f"{quantile([t.ms for t in two], 0.5):.2f}"),
    ]  # fmt: skip


def _looked(scene: Segments, pose: RigidTransform, scanner: Scanner, rng: np.random.Generator) -> Scan:
    ranges = scan(scene, pose, scanner, rng).ranges
    return seen_by(LaserScan(scanner.angle_min, scanner.angle_increment, ranges, 0.0, scanner.range_max))


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
        first = _tried(index, _looked(walls, pose, scanner, rng), pose, PLAN_NEAR, PLAN_TURNED)
        still.append(first)
        if not first.usable:
            continue
        ranges = _moving_ranges(walls, pose, scanner, motion, rng)
        for by, trials in ((motion, told), (None, untold)):
            laser = LaserScan(scanner.angle_min, scanner.angle_increment, ranges, 0.0, scanner.range_max, by)
            trials.append(_tried(index, seen_by(laser), pose, PLAN_NEAR, PLAN_TURNED))
    return [
        _share("standing still", still),
        _share("of those, 90 degrees/s and 1 m/s, with twist", told, 0.8), _wrong(told),
        at_least("  right first", mean(t.right for t in told), 0.95),
        _share("  without", untold), _wrong(untold),
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
