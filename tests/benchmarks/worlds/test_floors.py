"""Drawn buildings of several floors: what floors share is the same, and the rest is not."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.worlds import FLOOR_KINDS, draw_floors, free_places


@pytest.mark.parametrize("name", FLOOR_KINDS)
def test_floors_share_outer_walls_and_shafts_and_differ_otherwise(name: str) -> None:
    kind = FLOOR_KINDS[name]
    floors = draw_floors(kind, 4, np.random.default_rng(3))
    rows = [{tuple(row) for row in floor.endpoints.tolist()} for floor in floors]
    shared = set.intersection(*rows)
    width, depth = kind.size
    outer = {(0.0, 0.0, width, 0.0), (width, 0.0, width, depth), (width, depth, 0.0, depth), (0.0, depth, 0.0, 0.0)}
    assert outer <= shared
    assert len(shared) >= 4 + 3 * 4  # the outer walls, and three cores
    assert all(len(own - shared) >= 10 for own in rows)
    assert all(own != other for k, own in enumerate(rows) for other in rows[:k])


def test_the_same_generator_draws_the_same_floors() -> None:
    kind = FLOOR_KINDS["flats"]
    first, second = (draw_floors(kind, 2, np.random.default_rng(8)) for _ in range(2))
    assert all((a.endpoints == b.endpoints).all() for a, b in zip(first, second, strict=True))


@pytest.mark.parametrize("name", FLOOR_KINDS)
def test_places_are_free_and_inside(name: str) -> None:
    kind, rng = FLOOR_KINDS[name], np.random.default_rng(1)
    (floor,) = draw_floors(kind, 1, rng)
    for x, y in free_places(floor, kind, 20, rng):
        assert 0.0 < x < kind.size[0]
        assert 0.0 < y < kind.size[1]
        begins, ends = floor.endpoints[:, :2], floor.endpoints[:, 2:]
        along = np.clip(((np.array([x, y]) - begins) * (ends - begins)).sum(axis=1) / floor.lengths**2, 0.0, 1.0)
        gaps = np.linalg.norm(begins + along[:, None] * (ends - begins) - [x, y], axis=1)
        assert gaps.min() >= 0.45
