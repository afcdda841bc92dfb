"""Buildings and cases are drawn as they were: figures of benchmarks compare only while the same seed draws the same.

After a change that is meant to draw others: ``python -m tests.benchmarks.worlds.test_as_drawn``.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike

from benchmarks.peers.scenes import DRAWN_LEVELS, KINDS, SIZES, drawn_cell
from benchmarks.worlds import CONDITIONS, FAMILIES, FLOOR_KINDS, draw_case, draw_floors
from simulation import OfficePlan, World, offices

FILE = Path(__file__).with_name("as_drawn.json")
SEEDS = range(1, 9)
LEVELS = {level.name: level for level in DRAWN_LEVELS}
Numbers = list[float]


def mark(*arrays: ArrayLike) -> Numbers:
    """Return how many numbers there are, and sums of them by weights of their positions."""
    flat = np.concatenate([np.nan_to_num(np.asarray(a, dtype=float), posinf=1e3).ravel() for a in arrays])
    k = np.arange(len(flat))
    return [float(len(flat)), *(round(float(flat @ np.cos(pace * k)), 4) for pace in (0.0, 0.37, 1.1))]


def building(name: str) -> Numbers:
    found: Numbers = []
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        drawn = FAMILIES[name].draw(rng).build(rng)
        kinds = [zlib.crc32(kind.encode()) % 1000 for kind in drawn.kinds]
        found += mark(drawn.segments.endpoints, drawn.things, drawn.doors, kinds)
    return found


def case(condition: str) -> Numbers:
    found: Numbers = []
    for number, world in enumerate(("warehouse", "hotel", "cubicles", "facades")):
        one = draw_case(world, condition, number)
        pose = (one.pose.x, one.pose.y, one.pose.theta)
        truth = () if one.truth is None else (one.truth.x, one.truth.y, one.truth.theta)
        window = () if one.window is None else (one.window.pose.x, one.window.radius, one.window.angle)
        found += mark(one.map.endpoints, one.scene.endpoints, one.shown.endpoints)
        found += mark(one.ranges, pose, truth, window, [one.clutter])
    return found


def floors(name: str) -> Numbers:
    return mark(*(floor.endpoints for floor in draw_floors(FLOOR_KINDS[name], 4, np.random.default_rng(3))))


def peers(name: str) -> Numbers:
    kind, size, level = name.split()
    cell = drawn_cell(kind, int(size), LEVELS[level], 3, seed=3)
    poses = [(one.pose.x, one.pose.y, one.pose.theta) for one in cell.queries]
    return mark(*(part for one in cell.queries for part in (one.map, one.scan, one.on_map)), poses)


def office(rooms: str) -> Numbers:
    plan = OfficePlan(rooms=int(rooms), corridors=2 + int(rooms) % 3)
    world: World = offices(np.random.default_rng(int(rooms)), plan)
    return mark(world.segments.endpoints, [(pose.x, pose.y, pose.theta) for pose in world.poses])


DRAWN: dict[str, tuple[Callable[[str], Numbers], list[str]]] = {
    "building": (building, sorted(FAMILIES)),
    "case": (case, sorted(CONDITIONS)),
    "floors": (floors, sorted(FLOOR_KINDS)),
    "peers": (peers, [f"{kind} {min(SIZES)} {level}" for kind in KINDS for level in LEVELS]),
    "office": (office, ["1", "4", "9"]),
}
NAMES = [(kind, name) for kind, (_, names) in DRAWN.items() for name in names]


@pytest.mark.parametrize(("kind", "name"), NAMES)
def test_the_same_is_drawn_as_before(kind: str, name: str) -> None:
    kept = json.loads(FILE.read_text())[kind][name]
    np.testing.assert_allclose(DRAWN[kind][0](name), kept, atol=1e-3)


if __name__ == "__main__":
    every = {kind: {name: draw(name) for name in names} for kind, (draw, names) in DRAWN.items()}
    FILE.write_text(json.dumps(every).replace("}, ", "},\n").replace("], ", "],\n ") + "\n")
