"""Which sides of walls face free space, found by filling the drawing from free places."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum

import numpy as np
import scipy
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from registration.layout import Floats

from ...errors import InvalidOptionError

FINEST = 0.02  # m; cells of the picture that is filled
PIXELS = 16_000_000  # of it at most
MARGIN = 4  # cells around the drawing: outside is one place
ASIDE = 2.0  # cells from a line at which its sides are looked at
LEAST_SHARE = 0.2  # of a line that free space must lie along
SAMPLES = 64  # along a line at most


class Sides(IntEnum):
    """The free space of a drawing."""

    NEITHER = 0
    LEFT = 1
    RIGHT = 2
    BOTH = 3


def sides_seen(endpoints: Floats, places: Sequence[tuple[float, float]]) -> NDArray[np.int64]:
    """Tell on which sides of each line free space lies that some place is in.

    The lines are drawn into a picture that is then filled from the places: what they can reach is free.

    Parameters
    ----------
    endpoints : (n, 4)
        Metres, n at least 1.
    places : sequence of (x, y)
        Metres.

    Returns
    -------
    (n,) int64
        Values of `Sides`.

    Raises
    ------
    InvalidOptionError
        When a place lies on a line or outside of the drawing.
    """
    corners = endpoints.reshape(-1, 2)
    low, high = corners.min(axis=0), corners.max(axis=0)
    cell = max(FINEST, math.sqrt(float(np.prod(high - low)) / PIXELS), float((high - low).max()) / (PIXELS / 100))
    shape = np.ceil((high - low) / cell).astype(int) + 2 * MARGIN
    filled = _filled(endpoints, low, cell, (int(shape[0]), int(shape[1])), places)
    return _looked_at(endpoints, low, cell, filled)


def _filled(
    endpoints: Floats, low: Floats, cell: float, shape: tuple[int, int], places: Sequence[tuple[float, float]]
) -> NDArray[np.bool_]:
    """Return the cells that the places reach, by row and column."""
    picture = Image.new("1", shape)
    draw = ImageDraw.Draw(picture)
    for x1, y1, x2, y2 in (endpoints - np.tile(low, 2)) / cell + MARGIN:
        draw.line([(math.floor(x1), math.floor(y1)), (math.floor(x2), math.floor(y2))], fill=1)
    free = ~np.asarray(picture)
    # Lines of neighbouring and diagonal cells hold where only neighbours are connected.
    labels, _ = scipy.ndimage.label(free)
    wanted = []
    for k, place in enumerate(places):
        column, row = np.floor((np.asarray(place) - low) / cell + MARGIN).astype(int)
        inside = 0 <= row < shape[1] and 0 <= column < shape[0]
        if not inside or labels[row, column] == 0:
            raise InvalidOptionError(
                "lies on a line or outside of the drawing; expected a free place", argument="point", index=k
            )
        wanted.append(labels[row, column])
    return np.isin(labels, wanted)


def _looked_at(endpoints: Floats, low: Floats, cell: float, filled: NDArray[np.bool_]) -> NDArray[np.int64]:
    span = endpoints[:, 2:] - endpoints[:, :2]
    normals = np.stack([-span[:, 1], span[:, 0]], axis=1) / np.hypot(span[:, 0], span[:, 1])[:, None]
    along = (np.arange(SAMPLES) + 0.5) / SAMPLES
    seen = np.zeros(len(endpoints), dtype=np.int64)
    for side, sign in ((Sides.LEFT, 1.0), (Sides.RIGHT, -1.0)):
        met = np.zeros(len(endpoints))
        for share in along:
            places = (endpoints[:, :2] + share * span - low) / cell + MARGIN + sign * ASIDE * normals
            columns, rows = np.floor(places).astype(int).T
            met += filled[np.clip(rows, 0, filled.shape[0] - 1), np.clip(columns, 0, filled.shape[1] - 1)]
        seen += np.where(met >= LEAST_SHARE * SAMPLES, int(side), 0)
    return seen
