"""Scans of grids are simulated where the cells are."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.grid_scans import _borders, _chords
from formats.grids.cells import FREE, OCCUPIED, UNKNOWN
from registration import RigidTransform


def test_borders_run_along_the_cells_with_free_ones_on_the_left() -> None:
    cells = np.full((4, 5), UNKNOWN, dtype=np.int8)
    cells[1:3, 1:3] = FREE
    cells[1:3, 3] = OCCUPIED  # to the right, x from 3 to 4
    cells[3, 1:3] = OCCUPIED  # above, y from 3 to 4
    assert sorted(_borders(cells, OCCUPIED).tolist()) == [[3, 1, 3, 3], [3, 3, 1, 3]]
    assert sorted(_borders(cells, UNKNOWN).tolist()) == [[1, 1, 3, 1], [1, 3, 1, 1]]


def test_a_beam_runs_through_the_cell_that_it_enters() -> None:
    # From (0.5, 0.5) cells of 2 m: straight to the right through a whole cell; upwards by a diagonal from a corner.
    pose = RigidTransform(1.0, 1.0, 0.0)
    straight, diagonal = _chords(pose, np.array([0.0, math.pi / 4]), np.array([3.0, 3 * math.sqrt(2)]), 2.0)
    assert math.isclose(straight, 2.0)
    assert math.isclose(diagonal, 2.0 * math.sqrt(2.0))
