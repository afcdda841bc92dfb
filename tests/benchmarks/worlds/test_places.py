import numpy as np
import pytest

from benchmarks.worlds import free_place
from benchmarks.worlds.buildings.shapes import box, edges
from benchmarks.worlds.places import distances, is_free
from registration import Segments
from simulation import SimulationError

ROOM = np.vstack([edges(box(0, 0, 6, 4)), edges(box(2, 1, 3, 2)[::-1])])  # with a pillar


@pytest.mark.parametrize(
    ("x", "y", "free"),
    [(1.0, 1.0, True), (4.5, 2.0, True), (0.3, 2.0, False), (2.5, 1.5, False), (3.3, 1.5, False), (7.0, 2.0, False)],
)
def test_a_place_is_free_away_from_walls_and_on_their_free_side(x: float, y: float, free: bool) -> None:
    assert is_free(Segments.from_array(ROOM), x, y) is free


def test_a_place_from_which_nothing_is_seen_is_none() -> None:
    far = Segments.from_array([[0.0, 0.0, 1.0, 0.0]])
    assert not is_free(far, 0.5, 10.0)


def test_distances_are_those_of_segments_and_not_of_lines() -> None:
    walls = Segments.from_array([[0, 0, 2, 0], [5, 0, 5, 1]])
    np.testing.assert_allclose(distances(walls, 1.0, 3.0), [3.0, np.hypot(4.0, 2.0)])


def test_places_are_spread_over_all_that_is_free() -> None:
    rng = np.random.default_rng(1)
    places = [free_place(Segments.from_array(ROOM), rng) for _ in range(400)]
    x = np.array([p.x for p in places])
    # 0.4 m off all walls: 5.2 m by 3.2 m less a pillar; a third of it is right of 4 m.
    assert np.mean(x > 4.0) == pytest.approx(1.6 * 3.2 / (5.2 * 3.2 - 1.8**2), abs=0.08)
    assert len({round(p.theta, 6) for p in places}) == 400


def test_where_there_is_no_room_there_is_an_error() -> None:
    with pytest.raises(SimulationError) as caught:
        free_place(Segments.from_array(edges(box(0, 0, 0.6, 0.6))), np.random.default_rng(0))
    assert caught.value.argument == "segments"
