"""Test for outlines that intersect."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def crosses(outline: Floats, walls: Floats) -> bool:
    """Tell whether any side of an outline crosses a wall; touching is not crossing.

    Parameters
    ----------
    outline : (k, 4)
    walls : (n, 4)
        Metres.
    """
    low = np.minimum(outline[:, :2], outline[:, 2:]).min(axis=0)
    high = np.maximum(outline[:, :2], outline[:, 2:]).max(axis=0)
    x0, x1 = np.minimum(walls[:, 0], walls[:, 2]), np.maximum(walls[:, 0], walls[:, 2])
    y0, y1 = np.minimum(walls[:, 1], walls[:, 3]), np.maximum(walls[:, 1], walls[:, 3])
    near = walls[(x0 < high[0]) & (x1 > low[0]) & (y0 < high[1]) & (y1 > low[1])]
    if len(near) == 0:
        return False
    p, q = outline[:, None, :2], outline[:, None, 2:]
    r, s = near[None, :, :2], near[None, :, 2:]
    parted = _side(p, q, r) * _side(p, q, s) < 0.0
    return bool((parted & (_side(r, s, p) * _side(r, s, q) < 0.0)).any())


def _side(begin: Floats, end: Floats, point: Floats) -> Floats:
    """Return where a point lies: above 0 on the left of the line from begin to end."""
    along, to = end - begin, point - begin
    return np.asarray(along[..., 0] * to[..., 1] - along[..., 1] * to[..., 0])
