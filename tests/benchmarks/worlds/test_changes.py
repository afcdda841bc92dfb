import math

import numpy as np
import pytest

from benchmarks.worlds import FAMILIES, free_place
from benchmarks.worlds.buildings import Building
from benchmarks.worlds.buildings.plan import Plan
from benchmarks.worlds.buildings.shapes import box, crosses
from benchmarks.worlds.changes import clutter, with_doors
from registration import RigidTransform, Segments
from simulation import Scanner, scan

AHEAD = Scanner(1, 0.0, 0.1, sigma=0.0, range_max=100.0)


def two_rooms() -> Building:
    """Two rooms of 4 m by 4 m, a doorway of 1 m between them at y = 1 to 2."""
    plan = Plan()
    plan.room(box(0.0, 0.0, 4.0, 4.0))
    plan.room(box(4.2, 0.0, 8.2, 4.0))
    plan.opening((4.0, 1.0), (4.0, 2.0), 0.2, door=True)
    return plan.building("two rooms")


def store(count: int = 40) -> Building:
    plan = Plan()
    plan.room(box(0.0, 0.0, 4.0 * count, 6.0))
    for k in range(count):
        plan.thing("box", box(4.0 * k + 1.0, 2.0, 4.0 * k + 2.0, 3.0))
    return plan.building("store")


def ahead(segments: Segments, x: float, y: float, theta: float) -> float:
    return float(scan(segments, RigidTransform(x, y, theta), AHEAD).ranges[0])


def test_a_shut_door_is_a_wall_and_an_open_one_stands_in_the_room() -> None:
    building = two_rooms()
    assert ahead(building.segments, 1.0, 1.5, 0.0) == pytest.approx(7.2)
    shut = with_doors(building, np.random.default_rng(0), shut=1.0)
    assert shut.kinds == ("door",)
    assert ahead(shut.segments, 1.0, 1.5, 0.0) == pytest.approx(3.0)
    assert ahead(shut.segments, 6.0, 1.5, math.pi) == pytest.approx(6.0 - 4.04)
    opened = with_doors(building, np.random.default_rng(0), shut=0.0)
    # The hinge is at (4, 1); the leaf swings to the left of the way from there to (4, 2): to smaller x.
    assert ahead(opened.segments, 1.0, 1.9, 0.0) == pytest.approx(7.2)
    assert ahead(opened.segments, 3.5, 3.5, -0.5 * math.pi) == pytest.approx(2.5, abs=0.35)


@pytest.mark.parametrize("share", [0.33, 0.66])
@pytest.mark.parametrize("name", ["hotel", "garage", "facades"])
def test_clutter_takes_the_share_of_beams_that_was_asked_for(name: str, share: float) -> None:
    rng = np.random.default_rng(4)
    segments = FAMILIES[name].draw(rng).build(rng).segments
    scanner = Scanner.over(1.5 * math.pi, 720, range_max=25.0, sigma=0.0)
    for _ in range(8):
        pose = free_place(segments, rng, clearance=0.9)
        placed = clutter(segments, pose, scanner, share, rng)
        assert placed is not None
        outlines, reached = placed
        seen = scan(Segments.from_array(np.vstack([segments.endpoints, outlines])), pose, scanner)
        assert reached == pytest.approx(np.mean(seen.hits >= len(segments)), abs=1e-9)
        assert reached == pytest.approx(share, abs=0.03)
        assert seen.facing[seen.hits >= 0].all()
        assert not crosses(outlines, segments.endpoints)
