"""The tables of map updates."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

import map_quality
from association import Deadline, MapIndex
from map_quality import MapUpdate, VisitScan
from map_quality.update.scans import search
from registration import RigidTransform
from simulation import FAMILIES

from ..outcomes import progress
from ..table import Row, at_least, at_most, print_rows
from .judging import Judged, is_false, judge
from .scenes import Scene, drawn, visits, with_poses

VISITS, PLACES = 5, 60
MAP_SIGMA = 0.005  # m


def changes(families: Sequence[str], seeds: Sequence[int], *, listing: bool = False, own: bool = True) -> list[Row]:
    """Return the rows about changes of buildings in which a fifth of what can move has moved."""
    judged, usable, seconds = [], np.zeros(3), []
    for scene in drawn(families, seeds, PLACES):
        one, counts, took = _update(scene, listing=listing, own=own)
        judged.append(one)
        usable += counts
        seconds.append(took)
        progress(f"upkeep, {scene.family}", len(judged), len(families) * len(seeds))
    total = Judged(*(sum(getattr(one, name) for one in judged) for name in Judged.__slots__))
    return [
        at_least(f"changes found, of {total.shown} that scans show", total.found / max(1, total.shown), 0.9),
        at_least(f"  changes found, of all {total.all}", total.found / max(1, total.all)),
        at_most(f"false changes, of {total.proposed} proposed", total.false / max(1, total.proposed), 0.02),
        at_least("usable scans on the new map, of what the true map gives", usable[1] / usable[2], 0.98),
        at_least("  on the old map", usable[0] / usable[2]),
        at_most(f"  seconds for {VISITS * PLACES} scans, median", float(np.median(seconds)), form=".1f"),
    ]


def _update(scene: Scene, *, listing: bool, own: bool) -> tuple[Judged, np.ndarray, float]:
    rng = np.random.default_rng(7)
    taken = list(visits(scene, VISITS, rng))
    scans = with_poses(taken, rng) if own else [one for one, _ in taken]
    begun = time.perf_counter()
    update = map_quality.update(MapIndex.build(scene.mapped.segments, MAP_SIGMA), scans)
    took = time.perf_counter() - begun
    judged = judge(scene, [(one.visit, at) for one, at in taken], update)
    maps = (scene.mapped.segments, update.segments, scene.today.segments)
    counts = [_usable(MapIndex.build(one, MAP_SIGMA), taken) for one in maps]
    if listing:
        _list(scene, update, judged)
    return judged, np.array(counts), took


def _usable(index: MapIndex, taken: Sequence[tuple[VisitScan, RigidTransform]]) -> int:
    """Return how many scans are usable on a map, without a pose of their own."""
    return sum(search(index, one, Deadline()).usable for one, _ in taken[:: VISITS - 1])


def _list(scene: Scene, update: MapUpdate, judged: Judged) -> None:
    print(f"{scene.family}: {judged}, {update.usable}, {update.held_back}, {len(update.refused_visits)} refused")
    for one in update.changes:
        if is_false(one, scene):
            print("  false:", one.code, one.segments, one.new.round(2).tolist(), one.evidence, one.confidence)


def upkeep(quick: int) -> list[Row]:
    """Return the rows of all tables; buildings of which none is fitted on."""
    families = [name for name, one in FAMILIES.items() if one.held_out]
    rows = changes(families, range(max(1, 4 // quick)))
    print_rows("Map updates", rows)
    return rows
