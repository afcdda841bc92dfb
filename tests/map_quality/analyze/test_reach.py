"""Connected places of a map, compared with its rooms."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from map_quality import AnalysisError
from map_quality.analyze import standing
from registration import Segments
from registration.layout import Floats

AT = np.array([41.7, -1203.2])  # where the map lies


def lines(*ends: tuple[float, float, float, float]) -> Floats:
    moved: Floats = np.array(ends) + np.tile(AT, 2)
    return moved


def two_rooms(door: float) -> Floats:
    """Return rooms of 5 by 4 m with a wall between them that has a door in it, and which leans."""
    middle = 2.0 + 0.5 * door
    return lines(
        (0.0, 0.0, 10.0, 0.0), (10.0, 0.0, 10.0, 4.0), (10.0, 4.0, 0.0, 4.0), (0.0, 4.0, 0.0, 0.0),
        (4.6, 0.0, 5.0, 2.0 - 0.5 * door), (5.0, middle, 5.4, 4.0),
    )  # fmt: skip


def reached(ends: Floats, places: Floats, point: tuple[float, float] = (1.0, 1.0)) -> list[bool]:
    start = (AT + np.array(point)).tolist()
    found: list[bool] = standing.reached(Segments.from_array(ends), start, places + AT).tolist()
    return found


@pytest.mark.parametrize(("door", "beyond"), [(0.9, True), (0.3, True), (0.0, False)])
def test_a_door_lets_through_and_a_wall_does_not(door: float, beyond: bool) -> None:
    places = np.array([[0.3, 0.3], [3.9, 3.7], [6.0, 0.3], [9.7, 3.7], [9.7, 0.3]])
    assert reached(two_rooms(door), places) == [True, True, beyond, beyond, beyond]
    assert reached(two_rooms(door), places, (7.0, 2.0)) == [beyond, beyond, True, True, True]


def test_a_wall_in_many_pieces_is_a_wall() -> None:
    cuts = np.linspace(0.0, 4.0, 131)
    pieces = [(5.0 + 0.1 * a, a, 5.0 + 0.1 * b, b) for a, b in pairwise(cuts.tolist())]
    ends = np.vstack([two_rooms(0.0)[:4], lines(*pieces)])
    assert reached(ends, np.array([[4.0, 2.0], [7.0, 2.0]])) == [True, False]


def test_of_a_map_as_large_as_a_town_doors_are_seen_by_wider_cells() -> None:
    """900 m across: cells of 45 cm."""
    far = lines((900.0, 900.0, 900.0, 899.0), (0.0, 60.0, 60.0, 60.0), (60.0, 60.0, 60.0, 0.0), (60.0, 0.0, 0.0, 0.0))
    ends = np.vstack([far, lines((0.0, 0.0, 0.0, 20.0), (0.0, 22.0, 0.0, 60.0))])
    assert reached(ends, np.array([[30.0, 30.0], [300.0, 700.0]]), (30.0, 30.0)) == [True, True]
    closed = np.vstack([far, lines((0.0, 0.0, 0.0, 60.0))])
    assert reached(closed, np.array([[59.0, 59.0], [300.0, 700.0]]), (30.0, 30.0)) == [True, False]


def test_a_map_with_too_much_wall_is_refused() -> None:
    y = np.linspace(0.0, 1.0, 101)
    ends = np.stack([np.zeros(101), y, np.full(101, 9.95e3), y], axis=1)
    with pytest.raises(AnalysisError, match="a smaller map"):
        standing.reached(Segments.from_array(np.vstack([ends, ends])), (5.0, 0.505), np.zeros((0, 2)))


def test_a_point_has_to_be_on_the_map_and_on_no_wall() -> None:
    for point, what in (((-1.0, 1.0), "on the map"), ((1.0, 5.0), "on the map"), ((10.0, 2.0), "on a wall")):
        with pytest.raises(AnalysisError, match=what) as caught:
            reached(two_rooms(0.0), np.zeros((0, 2)), point)
        assert caught.value.argument == "point"
    places = np.stack(np.meshgrid(np.arange(0.05, 10.0, 0.1), np.arange(0.05, 4.0, 0.1)), axis=-1).reshape(-1, 2)
    assert math.isclose(sum(reached(two_rooms(0.0), places)) * 0.01, 4.8 * 4.0, rel_tol=0.06)
