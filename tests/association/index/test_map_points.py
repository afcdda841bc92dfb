"""Points of a map stop beams, and nothing else of a search changes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from association import NO_POINTS, InvalidMapError, MapIndex, MapPart, MapPoints
from association.consensus.kernels.sight import first_hit
from association.index.joint import JointIndex, gap_of
from association.layout import RAY
from registration import Segments

from ..scenes import ROOM

WALLS = Segments.from_array(ROOM)
POST = (2.0, 2.5)


def stopped_at(index: MapIndex, at: tuple[float, float], angle: float, limit: float = 20.0) -> float:
    """Return where a ray of the map frame is stopped by walls or points, metres."""
    ray, place = np.zeros(1, RAY)[0], index.obstacles
    x, y = np.array(at) - index.origin
    for name, value in (("x", x), ("y", y), ("dx", math.cos(angle)), ("dy", math.sin(angle)), ("limit", limit)):
        ray[name] = value
    return first_hit(ray, place.walls, place.grid.starts, place.grid.items, place.grid.shape[0])[0]


@pytest.mark.parametrize("angle", np.arange(16) * math.tau / 16 + 0.02)
def test_a_point_stops_beams_from_each_side(angle: float) -> None:
    index = MapIndex.build(WALLS, points=MapPoints.of([POST], 0.05))
    back = np.array([math.cos(angle), math.sin(angle)])
    beside = np.array([-back[1], back[0]])
    for off, stops in ((0.0, True), (0.03, True), (-0.03, True), (0.06, False), (-0.06, False)):
        x, y = np.array(POST) - back + off * beside
        reach = stopped_at(index, (x, y), angle)
        assert (abs(reach - 1.0) <= 0.06) is stops, off


def test_without_points_the_walls_stop_beams() -> None:
    index = MapIndex.build(WALLS)
    assert index.obstacles is index.tables.place
    assert MapIndex.build(WALLS, points=MapPoints.of([])).obstacles.walls is not None
    assert len(index.points) == 0


def test_points_change_no_other_table() -> None:
    bare, pointed = MapIndex.build(WALLS), MapIndex.build(WALLS, points=MapPoints.of([POST]))
    for name in ("place", "raster"):
        for one, other in zip(getattr(bare.tables, name), getattr(pointed.tables, name), strict=True):
            np.testing.assert_array_equal(one, other) if isinstance(one, np.ndarray) else None
    assert pointed.nbytes > bare.nbytes
    np.testing.assert_array_equal(bare.walls.rows, pointed.walls.rows)


def test_a_map_without_directions_keeps_its_points() -> None:
    index = MapIndex.build(WALLS, points=MapPoints.of([POST]))
    assert index.undirected.points is index.points
    assert stopped_at(index.undirected, (1.0, 2.5), 0.0) == pytest.approx(1.0)


def test_points_lie_on_their_own_map() -> None:
    parts = [MapPart(WALLS), MapPart(WALLS, points=MapPoints.of([POST], 0.02)), MapPart(WALLS, None, True, NO_POINTS)]
    index = JointIndex.of_parts(parts, gap_of(20.0))
    found = [stopped_at(index, tuple(np.array([1.0, 2.5]) + shift), 0.0) for shift in index.shifts]
    assert found[1] == pytest.approx(1.0)
    assert found[0] == found[2] == pytest.approx(found[0])
    assert found[0] > 2.0


@pytest.mark.parametrize(
    ("points", "sigma", "argument", "said"),
    [
        ([[1.0, 2.0, 3.0]], None, "map.points", "found an array of shape"),
        ([1.0, 2.0], None, "map.points", "found an array of shape"),
        ([[1.0, 2.0], [3.0]], None, "map.points", "rows"),
        ([["a", "b"]], None, "map.points", "rows"),
        ([[0.0, 0.0], [math.nan, 0.0]], None, "map.points.1", "finite"),
        (np.zeros((200_001, 2)), None, "map.points", "at most 200000 points, found 200001"),
        ([POST], 0.0, "map.points_sigma", "above 0"),
        ([POST], -1.0, "map.points_sigma", "above 0"),
        ([POST], 10.1, "map.points_sigma", "found 10.1"),
        ([POST], math.nan, "map.points_sigma", "above 0"),
    ],
)
def test_what_are_no_points(points: object, sigma: float | None, argument: str, said: str) -> None:
    with pytest.raises(InvalidMapError, match=said) as error:
        MapPoints.of(points, sigma)  # type: ignore[arg-type]
    assert error.value.argument == argument


def test_points_far_outside_are_left_out() -> None:
    """They would make the cells coarse, and of several maps they would lie on another one."""
    far = MapPoints.of([POST, [90.0, 0.0], [2e5, 0.0], [0.0, -90.0]])
    np.testing.assert_array_equal(MapIndex.build(WALLS, points=far).points.positions, [POST])
    together = JointIndex.of_parts([MapPart(WALLS, points=far), MapPart(WALLS)], gap_of(20.0))
    np.testing.assert_allclose(together.points.positions, [np.array(POST) + together.shifts[0]])
