"""The tables of map updates."""

from __future__ import annotations

import resource
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import reduce

import numpy as np

import map_quality
from association import Deadline, MapIndex
from map_quality import VisitScan
from map_quality.update.scans import search
from registration import RigidTransform, Segments
from simulation import FAMILIES, SimulationError

from ..outcomes import progress
from ..table import Row, at_least, at_most, print_rows, within
from .grids import errors, grid_map
from .judging import Judged, is_false, judge
from .scenes import Scene, draw, drawn, flipped, off_scale, routed, visits, with_odometry, with_poses

VISITS, PLACES = 5, 60
MAP_SIGMA = 0.005  # m
CONFIDENCES = ((0.0, 0.9), (0.9, 0.98), (0.98, 0.995), (0.995, 1.1))


def changes(families: Sequence[str], seeds: Sequence[int], *, poses: str = "own") -> list[Row]:
    """Return the rows about changes of buildings in which a fifth of what can move has moved.

    Scans have `poses` of the robot's own, by "odometry" along a route, or "none".
    """
    judged, usable, seconds = [], np.zeros(3), []
    for drawn_scene in drawn(families, seeds, PLACES):
        scene = routed(drawn_scene) if poses == "odometry" else drawn_scene
        one, counts, took = _update(scene, poses)
        judged.append(one)
        usable += counts
        seconds.append(took)
        progress(f"upkeep, {scene.family}", len(judged), len(families) * len(seeds))
    total = reduce(Judged.and_also, judged, Judged(0, 0, 0))
    proposed = len(total.right) + len(total.false)
    return [
        at_least(f"changes found, of {total.shown} that scans show", total.found / max(1, total.shown), 0.9),
        at_least(f"  changes found, of all {total.all}", total.found / max(1, total.all)),
        at_most(f"false changes, of {proposed} proposed", len(total.false) / max(1, proposed), 0.02),
        *_by_confidence(total),
        at_least("usable scans on the new map, of what the true map gives", usable[1] / usable[2], 0.98),
        at_least("  on the old map", usable[0] / usable[2]),
        at_most(f"  seconds for {VISITS * PLACES} scans, median", float(np.median(seconds)), form=".1f"),
    ]


def _by_confidence(total: Judged) -> list[Row]:
    """Return which fraction of the proposed changes is true, by their confidence."""
    rows = []
    for low, high in CONFIDENCES:
        right, false = (sum(low <= one < high for one in of) for of in (total.right, total.false))
        if right + false:
            what = f"  true changes, of {right + false} with a confidence from {low:g} to {min(high, 1.0):g}"
            rows.append(at_least(what, right / (right + false)))
    return rows


def _update(scene: Scene, poses: str) -> tuple[Judged, np.ndarray, float]:
    rng = np.random.default_rng(7)
    taken = list(visits(scene, VISITS, rng))
    scans = [one for one, _ in taken]
    if poses != "none":
        scans = with_poses(taken, rng) if poses == "own" else with_odometry(taken, rng)
    begun = time.perf_counter()
    update = map_quality.update(MapIndex.build(scene.mapped.segments, MAP_SIGMA), scans)
    took = time.perf_counter() - begun
    judged = judge(scene, [(one.visit, at) for one, at in taken], update)
    maps = (scene.mapped.segments, update.segments, scene.today.segments)
    counts = [_usable(MapIndex.build(one, MAP_SIGMA), taken) for one in maps]
    return judged, np.array(counts), took


def _usable(index: MapIndex, taken: Sequence[tuple[VisitScan, RigidTransform]]) -> int:
    """Return how many scans are usable on a map, without a pose of their own."""
    return sum(search(index, one, Deadline()).usable for one, _ in taken[:: VISITS - 1])


def sharper(families: Sequence[str], seeds: Sequence[int]) -> list[Row]:
    """Return the rows about maps of grids of 5 cm cells after 300 scans."""
    before, after, ratios = [], [], []
    for scene in drawn(families, seeds, PLACES, 0.0):
        rng = np.random.default_rng(11)
        old = grid_map(scene.mapped.segments, rng)
        taken = list(visits(scene, VISITS, rng))
        update = map_quality.update(MapIndex.build(old.segments, old.sigma), with_poses(taken, rng))
        sharp = update.sharpened
        error = errors(sharp.ends, scene.mapped.segments)
        known = ~np.isnan(error)
        blurred = errors(old.segments.endpoints[sharp.segments], scene.mapped.segments)
        before.append(blurred[~np.isnan(blurred)])
        after.append(error[known])
        ratios.append((error[known] / sharp.sigma[known]) ** 2)
        progress(f"upkeep, grids, {scene.family}", len(after), len(families) * len(seeds))
    if not sum(map(len, after)):
        return []
    one, two, nees = np.concatenate(before), np.concatenate(after), np.concatenate(ratios)
    return [
        at_most(
            f"RMS of {len(two)} walls of 5 cm grids after {VISITS * PLACES} scans, mm", 1e3 * _rms(two), 8.0, form=".1f"
        ),
        at_most("  before, mm", 1e3 * _rms(one), form=".1f"),
        within("  NEES of their sigma, mean", float(nees.mean()), 0.7, 1.5, form=".2f"),
    ]


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


ROUNDS, ROUND_VISITS, ROUND_PLACES = 10, 2, 40


def rounds(families: Sequence[str], seeds: Sequence[int]) -> list[Row]:
    """Return the rows about ten updates one after the other, with people and doors, of buildings that stay the same."""
    drift, wrong, done = [], 0, 0
    for scene in drawn(families, seeds, ROUND_PLACES, 0.0):
        rng, sigma = np.random.default_rng(13), 0.01
        segments: Segments = scene.mapped.segments
        for _ in range(ROUNDS):
            taken = list(visits(scene, ROUND_VISITS, rng, doors=True))
            update = map_quality.update(MapIndex.build(segments, sigma), with_poses(taken, rng))
            wrong += sum(is_false(one, scene, segments) for one in update.changes)
            segments, sigma = update.segments, update.sigma or sigma
        off = errors(segments.endpoints, scene.mapped.segments)
        drift.append(_rms(off[~np.isnan(off)]))
        done += 1
        progress(f"upkeep, rounds, {scene.family}", done, len(families) * len(seeds))
    return [
        at_most(f"drift after {ROUNDS} updates, worst of {done} buildings, mm", 1e3 * max(drift), 10.0, form=".1f"),
        at_most("  wrong walls", float(wrong), 0.0, form=".0f"),
    ]


def foreign(families: Sequence[str], logs: int) -> list[Row]:
    """Return the rows about scans of other buildings, of mirrored lasers and off scale: nothing may be proposed."""
    proposed: dict[str, int] = {}
    tried: dict[str, int] = {}
    for number in range(logs):
        own, other = (families[(number + k) % len(families)] for k in (0, 1))
        try:
            mapped, strange = draw(own, 100 + number, 8), draw(other, 500 + number, 8)
        except SimulationError:
            continue
        rng, kind = np.random.default_rng(number), ("another building", "mirrored", "off scale by 2 %")[number % 3]
        taken = list(visits(routed(strange if number % 3 == 0 else mapped), 3, rng))
        scans = with_odometry(taken, rng) if number // 3 % 2 else [one for one, _ in taken]
        if kind == "mirrored":
            scans = flipped(scans)
        elif kind != "another building":
            scans = off_scale(scans, 1.02 if number % 2 else 0.98)
        update = map_quality.update(MapIndex.build(mapped.mapped.segments, MAP_SIGMA), scans)
        proposed[kind] = proposed.get(kind, 0) + bool(update.changes)
        tried[kind] = tried.get(kind, 0) + 1
        progress("upkeep, foreign logs", number + 1, logs)
    return [
        at_most(f"logs with proposed changes: {kind}, {tried[kind]} logs", float(proposed[kind]), 0.0, form=".0f")
        for kind in tried
    ]


def speed(families: Sequence[str], scans: int, least: int) -> list[Row]:
    """Return the rows about many scans in a large map: buildings next to one another, at least so many segments."""
    rng = np.random.default_rng(17)
    shift, seed = 0.0, 0
    walls: list[np.ndarray] = []
    taken: list[list[VisitScan]] = []
    while (so_far := sum(len(one) for one in walls)) < least:
        scene = draw(families[seed % len(families)], seed, PLACES)
        seed += 1
        if so_far + len(scene.mapped.segments) > 1.1 * least:
            continue
        low, high = (f(scene.mapped.segments.endpoints[:, [0, 2]]) for f in (np.min, np.max))
        walls.append(scene.mapped.segments.endpoints + np.array([shift - low, 0.0, shift - low, 0.0]))
        taken.append(_aside(with_poses(list(visits(scene, VISITS, rng)), rng), shift - low))
        shift += float(high - low) + 20.0
    together = [one for some in zip(*taken, strict=True) for one in some][:scans]
    index = MapIndex.build(Segments.from_array(np.concatenate(walls)), MAP_SIGMA)
    map_quality.update(index, together[:20])
    rows, before = [], _memory()
    for how, some in (
        ("without poses", [replace(one, pose=None, covariance=None) for one in together]),
        ("each with a pose of the robot", together),
    ):
        begun = time.process_time()
        update = map_quality.update(index, some)
        what = f"seconds of a core for {len(some)} scans in a map of {len(index.segments)} segments, {how}"
        rows.append(at_most(what, time.process_time() - begun, 20.0, form=".1f"))
        rows.append(at_least(f"  changes proposed, {how}", float(len(update.changes)), form=".0f"))
    return [
        *rows,
        at_most("memory of the process at most, MB", _memory(), 500.0, form=".0f"),
        at_most("  before the updates, MB", before, form=".0f"),
    ]


def _aside(scans: Sequence[VisitScan], shift: float) -> list[VisitScan]:
    """Return scans whose poses are shifted along x."""
    aside = RigidTransform(shift, 0.0, 0.0)
    return [one if one.pose is None else replace(one, pose=aside.compose(one.pose)) for one in scans]


def _memory() -> float:
    """Return the most memory that the process has had, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def _families() -> list[str]:
    """Return the kinds of buildings that nothing is fitted on."""
    return [name for name, one in FAMILIES.items() if one.held_out]


PARTS: dict[str, Callable[[int], list[Row]]] = {
    "upkeep-changes": lambda quick: changes(_families(), range(max(1, 4 // quick))),
    "upkeep-without-poses": lambda quick: changes(_families(), range(max(1, 2 // quick)), poses="none"),
    "upkeep-odometry": lambda quick: changes(_families(), range(max(1, 2 // quick)), poses="odometry"),
    "upkeep-grids": lambda quick: sharper(_families(), range(max(1, 2 // quick))),
    "upkeep-rounds": lambda quick: rounds(_families()[:: min(quick, 4)], range(1)),
    "upkeep-foreign": lambda quick: foreign(_families(), max(6, 1000 // quick)),
    "upkeep-speed": lambda quick: speed(_families(), max(100, 1000 // quick), max(500, 2000 // quick)),
}


def printed(name: str) -> Callable[[int], list[Row]]:
    """Return a part that prints its rows."""

    def part(quick: int) -> list[Row]:
        rows = PARTS[name](quick)
        print_rows(f"Map updates: {name}", rows)
        return rows

    return part


UPKEEP = {name: printed(name) for name in PARTS}
