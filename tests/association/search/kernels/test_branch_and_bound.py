"""Branch and bound finds what a look at every pose finds."""

from __future__ import annotations

import numpy as np
import pytest
from association.search.kernels.branch_and_bound import branch_and_bound, greatest_mean

from association.layout import FOUND, GRID_SHAPE, record
from association.search.layout import CELL_POSE
from registration.layout import Records

LEVELS = 4
APART = 2, 0  # cells and headings
GOES_ON = np.zeros(1, np.uint8)


def pyramid_of(field: np.ndarray) -> np.ndarray:
    """Return the greatest value of the cells up and to the right of each, by level."""
    rows, columns = field.shape
    levels = [field]
    for k in range(1, LEVELS):
        size = 1 << k
        levels.append(
            np.array([[field[r : r + size, c : c + size].max() for c in range(columns)] for r in range(rows)])
        )
    return np.stack(levels)


def drawn(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return a field with some walls, and points by heading, some of which leave the field."""
    rng = np.random.default_rng(seed)
    field = np.zeros((37, 29), np.uint8)
    for _ in range(12):
        r, c, length = rng.integers(0, 30), rng.integers(0, 22), rng.integers(3, 12)
        part = field[r, c : c + length] if rng.random() < 0.5 else field[r : r + length, c]
        part[:] = np.maximum(part, rng.integers(60, 256, len(part)))
    return field, rng.integers(-9, 10, (6, 12, 2)).astype(np.int32)


def values_of(field: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """Return the value of every pose, (headings, rows, columns)."""
    rows, columns = field.shape
    wide = np.zeros((rows + 20, columns + 20), np.int64)
    wide[10:-10, 10:-10] = field
    return np.array(
        [sum(wide[10 + r : 10 + r + rows, 10 + c : 10 + c + columns] for r, c in points) for points in turned.tolist()]
    )


def found_in(field: np.ndarray, turned: np.ndarray, least: int, gap: int, most: int = 8) -> Records:
    found = np.zeros(most, CELL_POSE)
    count = branch_and_bound(pyramid_of(field), turned, least, gap, *APART, found, GOES_ON)
    return np.sort(found[:count], order=["value", "heading", "row", "column"])[::-1]


@pytest.mark.parametrize("seed", range(8))
def test_greatest_value_is_that_of_all_poses(seed: int) -> None:
    field, turned = drawn(seed)
    values = values_of(field, turned)
    found = found_in(field, turned, values.max() - 1, 0)
    assert found["value"][0] == values.max()
    for one in found:
        assert values[one["heading"], one["row"], one["column"]] == one["value"]


@pytest.mark.parametrize("seed", range(8))
def test_no_pose_within_the_gap_is_missed(seed: int) -> None:
    """Each is found, or near one that is found and as good."""
    field, turned = drawn(seed)
    values, gap = values_of(field, turned), 80
    found = found_in(field, turned, 0, gap, 400)
    for heading, row, column in np.argwhere(values > values.max() - gap).tolist():
        near = (np.abs(found["row"] - row) <= APART[0]) & (np.abs(found["column"] - column) <= APART[0])
        near &= np.abs(found["heading"] - heading) <= APART[1]
        assert (found["value"][near] >= values[heading, row, column]).any()


def test_none_is_found_that_does_not_exceed_the_least() -> None:
    field, turned = drawn(3)
    assert len(found_in(field, turned, int(values_of(field, turned).max()), 50)) == 0


def test_the_best_are_kept_where_there_are_too_many() -> None:
    field, turned = drawn(5)
    every, few = found_in(field, turned, 0, 400, 400), found_in(field, turned, 0, 400, 3)
    assert len(every) > len(few) == 3
    assert few["value"].tolist() == every["value"][:3].tolist()


def test_a_flag_ends_the_search() -> None:
    field, turned = drawn(1)
    found = np.zeros(8, CELL_POSE)
    assert branch_and_bound(pyramid_of(field), turned, 0, 400, *APART, found, np.ones(1, np.uint8)) == 0


def test_mean_of_the_best_of_some_poses() -> None:
    field = np.zeros((20, 30), np.uint8)
    field[5, 10:20] = 255
    shape = record(GRID_SHAPE, x0=-1.0, y0=-2.0, cell=0.2, columns=30, rows=20)
    points = np.stack([np.full(10, 1.0), np.arange(10) * 0.2], axis=1)
    poses = np.zeros(2, FOUND)
    # A quarter turn to the right lays the points along the row.
    poses["theta"], poses["x"], poses["y"] = [0.0, -0.5 * np.pi], [0.0, 1.1], [0.0, 0.1]
    assert greatest_mean(field, shape, points, poses[:1]) == 0.0
    assert greatest_mean(field, shape, points, poses) == pytest.approx(1.0)
    assert greatest_mean(field, shape, points, poses[:0]) == 0.0
