"""Which floor: scans on all floors of a building at once, drawn buildings whose floors share what floors share.

Five kinds of buildings, none of which the verdict's models were fitted to. The floors of one share outer walls, stairs,
shafts, columns and the module of the rooms. Each scan is searched on its own floor alone, on each other floor alone,
and on all floors together; then on all floors but its own.

Another floor explains a scan where a search on that floor alone scores within `AS_WELL` nats of the right floor.

``python -m benchmarks floors``, or with sizes ``python -m benchmarks.floors --floors 2 5 12 --scans 4 --buildings 1``
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from statistics import median

import numpy as np

import linefix
from association import (
    AS_WELL,
    AssociationResult,
    MapIndex,
    MapPart,
    MapSet,
    Scan,
    associate,
    associate_on_maps,
    map_set,
)
from registration import RigidTransform, Segments, wrap_angle
from simulation import FLOOR_KINDS, FloorKind, Scanner, draw_floors, free_places, scan

from .outcomes import progress
from .table import Row, at_least, at_most, mean, print_rows

FLOORS = (2, 5, 12)
SIZES = (2, 8, 32)  # floors of the times
SCANNER = Scanner(beams=720, sigma=0.01, range_max=30.0)
DISTANCE, ANGLE = 0.3, math.radians(5.0)
SEED = 20261126


@dataclass(slots=True)
class Floors:
    """Counts of all scans.

    Attributes
    ----------
    wanted : list of bool
        Of each scan that its floor alone makes usable, and that no other floor explains: whether the answer on all
        floors is usable and right.
    wrong : list of bool
        Of each usable answer: whether the floor is wrong, or the pose on it.
    one_by_one : list of bool
        Of each scan of which exactly one floor, searched alone, is usable: whether that floor is wrong.
    absent : list of bool
        Of each scan without its floor that no other floor explains: whether the answer is usable.
    absent_explained : list of bool
        The same of scans that another floor explains.
    equal : list of bool
        Of each scan of a floor that is there twice: whether the answer is not usable and lists both.
    """

    wanted: list[bool] = field(default_factory=list)
    wrong: list[bool] = field(default_factory=list)
    one_by_one: list[bool] = field(default_factory=list)
    absent: list[bool] = field(default_factory=list)
    absent_explained: list[bool] = field(default_factory=list)
    equal: list[bool] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Building:
    """A drawn building, ready to be searched."""

    kind: FloorKind
    floors: tuple[Segments, ...]
    alone: tuple[MapIndex, ...]
    together: MapSet

    @classmethod
    def draw(cls, kind: FloorKind, count: int, rng: np.random.Generator) -> Building:
        """Draw one of `count` floors."""
        floors = tuple(draw_floors(kind, count, rng))
        return cls(kind, floors, tuple(map(MapIndex.build, floors)), together(floors))

    def without(self, floor: int) -> MapSet:
        """Return all floors but one."""
        return map_set({str(k): MapPart(one) for k, one in enumerate(self.floors) if k != floor})


def together(floors: Sequence[Segments]) -> MapSet:
    """Return floors as maps that are searched together, named by their numbers."""
    return map_set({str(k): MapPart(one) for k, one in enumerate(floors)})


def take(floor: Segments, pose: RigidTransform, rng: np.random.Generator) -> Scan:
    """Scan a floor."""
    ranges = scan(floor, pose, SCANNER, rng).ranges
    return linefix.scan_of(linefix.LaserScan(SCANNER.angle_min, SCANNER.angle_increment, ranges, 0.1, 30.0))


def is_right(result: AssociationResult, truth: RigidTransform) -> bool:
    """Return whether a pose is the truth."""
    pose = result.pose
    if pose is None:
        return False
    away = math.hypot(pose.x - truth.x, pose.y - truth.y)
    return away < DISTANCE and abs(wrap_angle(pose.theta - truth.theta)) < ANGLE


def score_of(result: AssociationResult) -> float:
    """Return the score of an answer, nats; 0 without one."""
    return 0.0 if result.diagnostics is None else result.diagnostics.score


def try_floor(building: Building, floor: int, scans: int, found: Floors, rng: np.random.Generator) -> None:
    """Scan one floor of a building, and count the answers."""
    without = building.without(floor) if len(building.floors) > 2 else None
    twice = map_set({"a": MapPart(building.floors[floor]), "b": MapPart(building.floors[floor])})
    for number, (x, y) in enumerate(free_places(building.floors[floor], building.kind, scans, rng)):
        truth = RigidTransform(x, y, float(rng.uniform(-math.pi, math.pi)))
        seen = take(building.floors[floor], truth, rng)
        alone = [associate(one, seen) for one in building.alone]
        usable = [k for k, one in enumerate(alone) if one.usable]
        if len(usable) == 1:
            found.one_by_one.append(usable[0] != floor)
        least = score_of(alone[floor]) - AS_WELL
        explained = any(score_of(one) >= least for k, one in enumerate(alone) if k != floor)
        answer = associate_on_maps(building.together, seen)
        right = answer.map_id == str(floor) and is_right(answer, truth)
        if answer.usable:
            found.wrong.append(not right)
        if alone[floor].usable and not explained:
            found.wanted.append(answer.usable and right)
        if without is not None:
            (found.absent_explained if explained else found.absent).append(associate_on_maps(without, seen).usable)
        if number == 0:
            same = associate_on_maps(twice, seen)
            poses = {one.map_id for one in same.maps if one.pose is not None}
            found.equal.append(not same.usable and (same.pose is None or poses == {"a", "b"}))


def times(sizes: Sequence[int], repeats: int) -> list[tuple[int, float, float, float, float]]:
    """Return floors, and ms in the median and p95: of one search on the right floor, and of one on all floors."""
    rows = []
    for count in sizes:
        rng = np.random.default_rng(SEED)
        building = Building.draw(FLOOR_KINDS["offices"], count, rng)
        one: list[float] = []
        all_floors: list[float] = []
        for number in range(repeats):
            floor = number % count
            ((x, y),) = free_places(building.floors[floor], building.kind, 1, rng)
            seen = take(building.floors[floor], RigidTransform(x, y, float(rng.uniform(-3.0, 3.0))), rng)
            # By turns, so that what else the machine does counts for both.
            one.append(_milliseconds(partial(associate, building.alone[floor], seen)))
            all_floors.append(_milliseconds(partial(associate_on_maps, building.together, seen)))
        rows.append((count, *_both(one), *_both(all_floors)))
    return rows


def _milliseconds(call: Callable[[], object]) -> float:
    begun = time.process_time()
    call()
    return 1e3 * (time.process_time() - begun)


def _both(values: list[float]) -> tuple[float, float]:
    return median(values), float(np.quantile(values, 0.95))


def floors(
    counts: Sequence[int] = FLOORS, scans: int = 8, buildings: int = 2, sizes: Sequence[int] = SIZES, repeats: int = 20
) -> list[Row]:
    """Return the rows of all buildings, each floor scanned `scans` times."""
    found, rng = Floors(), np.random.default_rng(SEED)
    plans = [(name, count) for name in FLOOR_KINDS for count in counts for _ in range(buildings)]
    for done, (name, count) in enumerate(plans):
        building = Building.draw(FLOOR_KINDS[name], count, rng)
        for floor in range(count):
            try_floor(building, floor, scans, found, rng)
        progress("floors", done + 1, len(plans))
    rows = [
        at_least(_counted("usable and right, where one search on its floor is usable and no other floor explains it",
                          found.wanted), mean(found.wanted), 0.95),
        at_most(_counted("wrong, of usable", found.wrong), mean(found.wrong), 0.001, form=".4f"),
        at_most(_counted("the same, floor by floor, where exactly one floor is usable", found.one_by_one),
                mean(found.one_by_one), form=".4f"),
        at_most(_counted("floor not in the set: usable, where no other floor explains it", found.absent),
                mean(found.absent), 0.01, form=".4f"),
        at_most(_counted("floor not in the set: usable, where another floor explains it", found.absent_explained),
                mean(found.absent_explained), form=".4f"),
        at_least(_counted("a floor twice: said so, and both listed", found.equal), mean(found.equal), 1.0),
    ]  # fmt: skip
    for count, one, one_p95, every, every_p95 in times(sizes, repeats):
        told = (
            f"{count} floors: {every:.1f} ms (p95 {every_p95:.1f}), one search {one:.1f} ms (p95 {one_p95:.1f}); times"
        )
        rows.append(at_most(told, every / one, 8.0 if count == 32 else None, form=".2f"))
    return rows


def _counted(what: str, values: list[bool]) -> str:
    return f"{what} ({sum(values)} of {len(values)})"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--floors", type=int, nargs="+", default=list(FLOORS), help="floors of a building")
    parser.add_argument("--scans", type=int, default=8, help="scans a floor")
    parser.add_argument("--buildings", type=int, default=2, help="buildings of each kind and number of floors")
    parser.add_argument("--sizes", type=int, nargs="+", default=list(SIZES), help="floors of the times")
    parser.add_argument("--repeats", type=int, default=20, help="scans of the times")
    asked = parser.parse_args()
    print_rows("Floors", floors(asked.floors, asked.scans, asked.buildings, asked.sizes, asked.repeats))


if __name__ == "__main__":
    main()
