"""The likelihood field of a map: how near each place is to a wall."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import maximum_filter1d

from association import MapIndex
from association.index.tuning import FIELD_CELL, FIELD_DEVIATION, FIELD_LEVELS, MOST_FIELD_CELLS
from registration import Segments

from ..kernels.drawn import INDEX


def distances_to_walls(index: MapIndex, points: np.ndarray) -> np.ndarray:
    """Return the distance of each point of the index frame from the nearest segment."""
    ends = index.segments.endpoints - np.tile(index.origin, 2)
    begin, span = ends[:, :2], ends[:, 2:] - ends[:, :2]
    away = points[:, None] - begin
    along = np.clip((away * span).sum(axis=2) / (span * span).sum(axis=1), 0.0, 1.0)
    found: np.ndarray = np.linalg.norm(away - along[:, :, None] * span, axis=2).min(axis=1)
    return found


@pytest.mark.parametrize("index", [INDEX, INDEX.undirected])
def test_lowest_level_is_the_likelihood_of_the_distance_to_the_nearest_wall(index: MapIndex) -> None:
    """Up to the 3 cm by which segments may lie beside the walls that they are merged into."""
    field = index.likelihood_field
    assert field is not None
    rows, columns = field.pyramid[0].shape
    x, y = np.meshgrid(np.arange(columns) + 0.5, np.arange(rows) + 0.5)
    shape = field.shape[0]
    points = np.stack([shape["x0"] + x.ravel() * shape["cell"], shape["y0"] + y.ravel() * shape["cell"]], axis=1)
    away = distances_to_walls(index, points)
    low, high = (255.0 * np.exp(-0.5 * (np.maximum(0.0, away + by) / FIELD_DEVIATION) ** 2) for by in (0.03, -0.03))
    got = field.pyramid[0].ravel()
    assert np.all(got >= low - 1.0)
    assert np.all(got <= high + 1.0)
    assert got.max() > 200


def test_each_level_has_the_maxima_of_blocks_up_and_to_the_right() -> None:
    field = INDEX.likelihood_field
    assert field is not None
    for k in range(1, FIELD_LEVELS):
        size = 1 << k
        expected = field.pyramid[0]
        for axis in (0, 1):
            expected = maximum_filter1d(expected, size, axis=axis, origin=-(size // 2), mode="constant")
        assert np.array_equal(field.pyramid[k], expected), k


def test_a_map_that_is_too_large_has_none() -> None:
    far = FIELD_CELL * np.sqrt(MOST_FIELD_CELLS)
    corner = [[0.0, 0.0, 4.0, 0.0], [0.0, 4.0, 0.0, 0.0]]
    for there, none in ((0.9 * far, False), (1.1 * far, True)):
        segments = Segments.from_array(np.array([*corner, [there, there, there, there - 4.0]]))
        index = MapIndex.build(segments)
        assert (index.likelihood_field is None) is none
    small = MapIndex.build(Segments.from_array(np.array(corner)))
    assert small.likelihood_field is not None
    before = small.nbytes - small.likelihood_field.pyramid.nbytes
    assert before > 0, "what it takes is reckoned with"
