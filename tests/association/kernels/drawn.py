"""Maps for the tests of kernels, drawn by seed."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from association import MapIndex

from ..scenes import index_of, maze

SEEDS = st.integers(0, 2**31 - 1)
MAZE = maze(1)


def oblique(rng: np.random.Generator) -> MapIndex:
    """Return the maze with every wall turned a little, so that there are all kinds of directions."""
    ends = MAZE.reshape(-1, 2, 2)
    middles, angles = ends.mean(axis=1, keepdims=True), rng.uniform(-0.6, 0.6, len(ends))
    c, s = np.cos(angles)[:, None], np.sin(angles)[:, None]
    x, y = np.moveaxis(ends - middles, -1, 0)
    return index_of((middles + np.stack([c * x - s * y, s * x + c * y], axis=-1)).reshape(-1, 4))
