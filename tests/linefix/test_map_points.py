"""Two equal rooms: the posts of one of them, as points of the map, separate them for scans with ranges."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import linefix
from linefix import InputError, RigidTransform, Segments, simulation
from tests.association.scenes import known

ROOM = np.array([[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]], float)
ROOMS = np.vstack([ROOM, ROOM + np.array([9.0, 0.0, 9.0, 0.0])])
PLACES = [(3.2, 1.0), (1.5, 3.8), (2.6, 2.6), (3.5, 4.2), (5.2, 0.7), (0.6, 3.0)]
POSTS = np.array(
    [[[x + 0.25 * math.cos(k), y + 0.25 * math.sin(k)] for k in np.arange(32) * math.tau / 32] for x, y in PLACES]
)
SCANNER = simulation.Scanner(beams=720, sigma=0.01)
TRUTH = RigidTransform(1.0, 1.5, 0.3)


def ranges(*, posts: bool = True) -> Any:
    faces = np.concatenate([POSTS, np.roll(POSTS, -1, axis=1)], axis=2).reshape(-1, 4)
    world = Segments.from_array(np.vstack([ROOMS, faces]) if posts else ROOMS)
    return simulation.scan(world, TRUTH, SCANNER, np.random.default_rng(1)).ranges


def answer(*, posts: bool = True, **fields: Any) -> linefix.AssociationResult:
    index = linefix.index_map({"segments": ROOMS, **fields})
    return linefix.locate(index, ranges(posts=posts), (SCANNER.angle_min, SCANNER.angle_increment))


def test_points_separate_equal_rooms() -> None:
    without, with_points = answer(), answer(points=POSTS.reshape(-1, 2), points_sigma=0.03)
    assert (without.usable, without.reasons[0].code) == (False, "similar_place")
    assert with_points.usable
    assert math.hypot(known(with_points.pose).x - TRUTH.x, known(with_points.pose).y - TRUTH.y) < 0.03


def test_a_map_file_keeps_its_points(tmp_path: Any) -> None:
    points = POSTS.reshape(-1, 2)
    file = tmp_path / "rooms.json"
    linefix.write_map(linefix.LineMap(Segments.from_array(ROOMS), points=points, points_sigma=0.03), file)
    read = linefix.read_map(file).map
    np.testing.assert_array_equal(read.points, points)
    assert read.points_sigma == 0.03
    assert linefix.locate(read, ranges(), (SCANNER.angle_min, SCANNER.angle_increment)).usable


@pytest.mark.parametrize(
    ("fields", "argument"),
    [
        ({"points": [[1.0]]}, "map.points"),
        ({"points": [[1.0, math.inf]]}, "map.points.0"),
        ({"points": [[1.0, 2.0]], "points_sigma": "wide"}, "map.points_sigma"),
        ({"points": [[1.0, 2.0]], "points_sigma": 0}, "map.points_sigma"),
        ({"points_sigma": True}, "map.points_sigma"),
    ],
)
def test_points_that_are_none(fields: dict[str, Any], argument: str) -> None:
    with pytest.raises(InputError) as error:
        linefix.index_map({"segments": ROOMS, **fields})
    assert error.value.argument == argument
