"""Which floor: scans on all floors of a building at once, drawn buildings whose floors share what floors share.

Five kinds of buildings, none of which the verdict's models were fitted to. The floors of one share outer walls, stairs,
shafts, columns and the module of the rooms. Each scan is searched on its own floor alone, on each other floor alone,
and on all floors together; then on all floors but its own.

Another floor explains a scan where a search on that floor alone scores within `AS_WELL` nats of the right floor.

The times are those of one search on all floors, and of one on the right floor alone. A campus of public floor plans is
searched as one map for each plan, and as one map.

``python -m benchmarks floors``, or with sizes ``python -m benchmarks.floors --floors 2 5 12 --scans 4 --buildings 1``;
without a number after ``--floors`` the times alone
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
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
from registration import MeasuredSegments, RigidTransform, Segments, wrap_angle
from simulation import FLOOR_KINDS, FloorKind, Scanner, draw_floors, free_places, scan

from .collection import SIGMA
from .growth import campus_plans, draw_query
from .outcomes import progress
from .queries import data_found
from .table import Row, at_least, at_most, mean, print_rows

FLOORS = (2, 5, 12)
SIZES = (2, 8, 32, 128)  # floors of the times
TIMED = replace(FLOOR_KINDS["offices"], size=(80.0, 15.0))  # 400 segments a floor
CAMPUS = 20_000  # segments
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
    exact : list of bool
        The same of the answer where the maps declare that they are exact, as the drawn ones are.
    wrong, exact_wrong : list of bool
        Of each usable answer, without and with that: whether the floor is wrong, or the pose on it.
    one_by_one : list of bool
        Of each scan of which exactly one floor, searched alone, is usable: whether that floor is wrong.
    absent : list of bool
        Of each scan without its floor that no other floor explains: whether the answer is usable.
    absent_exact : list of bool
        The same where the maps declare that they are exact.
    absent_explained : list of bool
        Of such scans that another floor explains, without that.
    equal : list of bool
        Of each scan of a floor that is there twice: whether the answer is not usable and lists both.
    """

    wanted: list[bool] = field(default_factory=list)
    exact: list[bool] = field(default_factory=list)
    wrong: list[bool] = field(default_factory=list)
    exact_wrong: list[bool] = field(default_factory=list)
    one_by_one: list[bool] = field(default_factory=list)
    absent: list[bool] = field(default_factory=list)
    absent_exact: list[bool] = field(default_factory=list)
    absent_explained: list[bool] = field(default_factory=list)
    equal: list[bool] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Building:
    """A drawn building, ready to be searched."""

    kind: FloorKind
    floors: tuple[Segments, ...]
    alone: tuple[MapIndex, ...]
    together: MapSet
    exact: MapSet

    @classmethod
    def draw(cls, kind: FloorKind, count: int, rng: np.random.Generator) -> Building:
        """Draw one of `count` floors."""
        floors = tuple(draw_floors(kind, count, rng))
        return cls(kind, floors, tuple(map(MapIndex.build, floors)), together(floors), together(floors, 0.0))

    def without(self, floor: int, sigma: float | None = None) -> MapSet:
        """Return all floors but one."""
        return map_set({str(k): MapPart(one, sigma) for k, one in enumerate(self.floors) if k != floor})


def together(floors: Sequence[Segments], sigma: float | None = None) -> MapSet:
    """Return floors as maps that are searched together, named by their numbers."""
    return map_set({str(k): MapPart(one, sigma) for k, one in enumerate(floors)})


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
    without = [building.without(floor, sigma) for sigma in (None, 0.0)] if len(building.floors) > 2 else []
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
        for maps, wanted, wrong in (
            (building.together, found.wanted, found.wrong),
            (building.exact, found.exact, found.exact_wrong),
        ):
            answer = associate_on_maps(maps, seen)
            right = answer.map_id == str(floor) and is_right(answer, truth)
            if answer.usable:
                wrong.append(not right)
            if alone[floor].usable and not explained:
                wanted.append(answer.usable and right)
        for maps, absent in zip(without, (found.absent, found.absent_exact), strict=False):
            if not explained:
                absent.append(associate_on_maps(maps, seen).usable)
        if without and explained:
            found.absent_explained.append(associate_on_maps(without[0], seen).usable)
        if number == 0:
            same = associate_on_maps(twice, seen)
            poses = {one.map_id for one in same.maps if one.pose is not None}
            found.equal.append(not same.usable and (same.pose is None or poses == {"a", "b"}))


def time_rows(sizes: Sequence[int], repeats: int) -> list[Row]:
    """Return the rows of the times of buildings with so many floors, and of a campus."""
    rows: list[Row] = []
    for done, count in enumerate(sizes):
        one, every = building_times(count, repeats)
        rows += [*_times(f"{count} floors: right floor alone", one), *_times(f"{count} floors: all", every)]
        rows.append(_ratio(f"{count} floors: all, over one", every, one, 8.0 if count == 32 else None))
        progress("times", done + 1, len(sizes) + 1)
    if sizes and data_found():
        plans, one, every, whole = campus_times(repeats)
        rows += [*_times("campus: right map alone", one), *_times("campus: all maps", every)]
        rows += [*_times("campus: as one map", whole), at_least("campus: maps", plans, form=".0f")]
        rows += [_ratio("campus: all maps, over one", every, one), _ratio("campus: as one map, over one", whole, one)]
    return rows


def building_times(count: int, repeats: int) -> tuple[list[float], list[float]]:
    """Return ms of searches on the right floor, and on all floors."""
    rng = np.random.default_rng(SEED)
    building = Building.draw(TIMED, count, rng)
    one: list[float] = []
    every: list[float] = []
    for number in range(repeats + 1):
        floor = number % count
        ((x, y),) = free_places(building.floors[floor], building.kind, 1, rng)
        seen = take(building.floors[floor], RigidTransform(x, y, float(rng.uniform(-3.0, 3.0))), rng)
        # By turns, so that what else the machine does counts for both.
        one.append(_milliseconds(partial(associate, building.alone[floor], seen)))
        every.append(_milliseconds(partial(associate_on_maps, building.together, seen)))
    return one[1:], every[1:]  # without the first search, which warms up


def campus_times(repeats: int) -> tuple[int, list[float], list[float], list[float]]:
    """Return the number of plans, and ms of searches on the right plan, on all as maps, and on all as one map."""
    rng = np.random.default_rng(SEED)
    plans = [Segments.from_array(one) for one in campus_plans(CAMPUS)]
    segments = Segments.from_array(np.vstack([one.endpoints for one in plans]))
    index, alone, all_plans = MapIndex.build(segments), list(map(MapIndex.build, plans)), together(plans)
    one: list[float] = []
    every: list[float] = []
    whole: list[float] = []
    for _ in range(repeats + 1):
        pose, drawn = draw_query(segments, rng)
        nearest = int(np.linalg.norm(segments.midpoints - [pose.x, pose.y], axis=1).argmin())
        plan = int(np.searchsorted(np.cumsum([len(part) for part in plans]), nearest, side="right"))
        seen = Scan(MeasuredSegments.from_segments(drawn, SIGMA))
        one.append(_milliseconds(partial(associate, alone[plan], seen)))
        every.append(_milliseconds(partial(associate_on_maps, all_plans, seen)))
        whole.append(_milliseconds(partial(associate, index, seen)))
    return len(plans), one[1:], every[1:], whole[1:]


def _milliseconds(call: Callable[[], object]) -> float:
    begun = time.process_time()
    call()
    return 1e3 * (time.process_time() - begun)


def _times(what: str, values: list[float]) -> list[Row]:
    p95 = float(np.quantile(values, 0.95))
    return [at_most(f"{what}, median ms", median(values), form=".1f"), at_most(f"{what}, p95 ms", p95, form=".1f")]


def _ratio(what: str, some: list[float], others: list[float], goal: float | None = None) -> Row:
    return at_most(f"{what}, ratio of medians", median(some) / median(others), goal, form=".2f")


def floors(
    counts: Sequence[int] = FLOORS, scans: int = 8, buildings: int = 2, sizes: Sequence[int] = SIZES, repeats: int = 20
) -> list[Row]:
    """Return the rows of all buildings, each floor scanned `scans` times, and those of the times."""
    return [*(answer_rows(counts, scans, buildings) if counts else []), *time_rows(sizes, repeats)]


def answer_rows(counts: Sequence[int], scans: int, buildings: int) -> list[Row]:
    """Return the rows of the answers."""
    found, rng = Floors(), np.random.default_rng(SEED)
    plans = [(name, count) for name in FLOOR_KINDS for count in counts for _ in range(buildings)]
    for done, (name, count) in enumerate(plans):
        building = Building.draw(FLOOR_KINDS[name], count, rng)
        for floor in range(count):
            try_floor(building, floor, scans, found, rng)
        progress("floors", done + 1, len(plans))
    fine, rare = partial(_counted, at_least, form=".3f"), partial(_counted, at_most, form=".4f")
    return [
        fine("usable and right, where its floor alone is usable and no other floor explains it", found.wanted, 0.95),
        fine("the same with sigma 0: usable and right", found.exact),
        rare("wrong, of usable", found.wrong, 0.001),
        rare("the same with sigma 0: wrong, of usable", found.exact_wrong, 0.001),
        rare("wrong, floor by floor, where exactly one floor is usable", found.one_by_one),
        rare("floor not in the set: usable, where no other floor explains it", found.absent, 0.01),
        rare("the same with sigma 0: floor not in the set, usable", found.absent_exact, 0.01),
        rare("floor not in the set: usable, where another floor explains it", found.absent_explained),
        fine("a floor twice: not usable, and both listed", found.equal, 1.0),
    ]


def _counted(row: Callable[..., Row], what: str, values: list[bool], goal: float | None = None, *, form: str) -> Row:
    """Return a row of a fraction, with its count."""
    made = row(what, mean(values), goal, form=form)
    return replace(made, measured=f"{made.measured} ({sum(values)} of {len(values)})")


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--floors", type=int, nargs="*", default=list(FLOORS), help="floors of a building")
    parser.add_argument("--scans", type=int, default=8, help="scans a floor")
    parser.add_argument("--buildings", type=int, default=2, help="buildings of each kind and number of floors")
    parser.add_argument("--sizes", type=int, nargs="*", default=list(SIZES), help="floors of the times")
    parser.add_argument("--repeats", type=int, default=20, help="scans of the times")
    asked = parser.parse_args()
    print_rows("Floors", floors(asked.floors, asked.scans, asked.buildings, asked.sizes, asked.repeats))


if __name__ == "__main__":
    main()
