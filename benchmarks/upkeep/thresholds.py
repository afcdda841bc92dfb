"""Move each threshold of map updates by 20 % either way, and count the changes that are proposed otherwise.

Buildings that have changed are updated with the thresholds as they are, then with each of them moved. A scan that was
searched in a map before keeps its answer.

``python -m benchmarks.upkeep.thresholds [--buildings 4] [--places 25] [--only NAME ...] [--list]``
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import map_quality
from association import AssociationResult, Deadline, MapIndex
from map_quality import VisitScan
from registration import RigidTransform
from simulation import FAMILIES

from ..outcomes import progress
from ..table import print_table
from ..threshold_effects import MOVED
from ..thresholds import Threshold, moved, thresholds
from .grids import grid_map
from .judging import Judged, judge
from .scenes import Scene, drawn, routed, visits, with_odometry, with_poses

SEED, VISITS, MAP_SIGMA = 30, 5, 0.005
KINDS = ("cubicles", "mirrored_flats", "supermarket", "hotel")
Search = Callable[[MapIndex, VisitScan, Deadline], AssociationResult]


@dataclass(frozen=True, slots=True, eq=False)
class Visited:
    """A building, its map, and the scans of several visits with their true poses.

    `scene` is None for a map of a grid: its segments are others, so that changes cannot be judged by their indices.
    """

    scene: Scene | None
    index: MapIndex
    scans: list[VisitScan]
    poses: list[tuple[str, RigidTransform]]


@dataclass(frozen=True, slots=True)
class Proposals:
    """The proposals for all buildings: their keys, and how good they are."""

    keys: frozenset[tuple[Any, ...]]
    judged: Judged
    usable: int
    sharpened: int


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.upkeep.thresholds", description=__doc__)
    parser.add_argument("--buildings", type=int, default=4, help="number of buildings; the last one is a map of a grid")
    parser.add_argument("--places", type=int, default=25, help="scans of a visit")
    parser.add_argument("--only", nargs="*", metavar="NAME", help="move these thresholds only")
    parser.add_argument("--list", action="store_true", help="list the thresholds")
    args = parser.parse_args()
    chosen = [one for one in thresholds("map_quality.update") if args.only is None or one.name in args.only]
    if args.list:
        print_table(f"{len(chosen)} thresholds", ("name", "value"), [(one.name, str(one.value)) for one in chosen])
        return
    sample = [
        visited(scene, on_grid=k == args.buildings - 1, odometry=k % 2 == 0)
        for k, scene in enumerate(scenes(args.buildings, args.places))
    ]
    remember_searches()
    before, rows = proposals(sample), []
    print(f"as they are: {len(before.judged.right)} proposed, {before.judged.found} of {before.judged.shown} found")
    for number, threshold in enumerate(chosen):
        rows.append((threshold, [effect(sample, before, threshold, factor) for factor in MOVED]))
        progress("thresholds", number + 1, len(chosen))
    rows.sort(key=lambda row: -max(changed for changed, _ in row[1]))
    cells = [(one.name, str(one.value), *(f"{changed}: {text}" for changed, text in both)) for one, both in rows]
    print_table("Thresholds of map updates moved by 20 %: proposals that change",
                ("threshold", "value", "x 0.8 changed: found false usable sharper", "x 1.2"), cells)  # fmt: skip
    still = [one.name for one, both in rows if not any(changed for changed, _ in both)]
    print(f"\n{len(still)} of {len(rows)} change nothing: {', '.join(still)}")


def scenes(count: int, places: int) -> list[Scene]:
    """Return changed buildings of kinds that nothing is fitted on."""
    kinds = [name for name in (KINDS * count)[:count] if FAMILIES[name].held_out]
    return [scene for k, name in enumerate(kinds) for scene in drawn([name], [SEED + k // len(KINDS)], places)]


def visited(scene: Scene, *, on_grid: bool, odometry: bool) -> Visited:
    """Return the scans of a building, with odometry or with poses of the robot.

    `on_grid`: in the map that a grid of it gives, whose walls can be sharpened.
    """
    scene = routed(scene) if odometry else scene
    rng = np.random.default_rng(SEED)
    old = grid_map(scene.mapped.segments, rng) if on_grid else None
    index = MapIndex.build(scene.mapped.segments, MAP_SIGMA) if old is None else MapIndex.build(old.segments, old.sigma)
    taken = list(visits(scene, VISITS, rng))
    scans = with_odometry(taken, rng) if odometry else with_poses(taken, rng)
    return Visited(None if on_grid else scene, index, scans, [(one.visit, at) for one, at in taken])


def remember_searches() -> None:
    """Let updates take the answer of a scan that was searched in the same map before."""
    modules = [importlib.import_module(f"map_quality.update.{name}") for name in ("update", "odometry")]
    search: Search = modules[0].search
    known: dict[tuple[Any, ...], AssociationResult] = {}

    def remembered(index: MapIndex, one: VisitScan, deadline: Deadline) -> AssociationResult:
        prior = None if one.covariance is None else one.covariance.tobytes()
        key = id(one.scan), one.pose, prior, index.segments.endpoints.tobytes(), index.sigma
        if key not in known:
            known[key] = search(index, one, deadline)
        return known[key]

    for module in modules:
        module.search = remembered  # type: ignore[attr-defined]


def proposals(sample: Sequence[Visited]) -> Proposals:
    """Update the maps of all buildings."""
    keys: list[tuple[Any, ...]] = []
    total, usable, sharpened = Judged(0, 0, 0), 0, 0
    for number, one in enumerate(sample):
        update = map_quality.update(one.index, one.scans)
        keys += [(number, change.code, change.segments, change.new.tobytes()) for change in update.changes]
        keys += [(number, "sharper", int(wall)) for wall in update.sharpened.segments]
        keys += [(number, "refused", visit.visit) for visit in update.refused_visits]
        sharpened += len(update.sharpened.segments)
        usable += update.usable.after
        if one.scene is not None:
            total = total.and_also(judge(one.scene, one.poses, update))
    return Proposals(frozenset(keys), total, usable, sharpened)


def effect(sample: Sequence[Visited], before: Proposals, threshold: Threshold, factor: float) -> tuple[int, str]:
    """Return how many proposals a moved threshold changes, and how many more are found, false, usable and sharper."""
    try:
        with moved(threshold, threshold.moved(factor)):
            after = proposals(sample)
    except ValueError as error:
        return 0, f"{type(error).__name__}"
    more = (
        after.judged.found - before.judged.found,
        len(after.judged.false) - len(before.judged.false),
        after.usable - before.usable,
        after.sharpened - before.sharpened,
    )
    return len(before.keys ^ after.keys), " ".join(f"{one:+d}" for one in more)


if __name__ == "__main__":
    main()
