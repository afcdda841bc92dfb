"""Lines that lie far from all others, which stretch a map and are rarely walls."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from registration.layout import Floats
from registration.limits import MAX_LENGTH

from ...errors import MalformedFileError
from ...limits import MAX_EXTENT, MAX_NAMED
from ...report import listed
from ..drawing import Drawing

Flags = NDArray[np.bool_]
Integers = NDArray[np.int64]

APART = 100.0  # m; cells that are no neighbours are two places
FAR_SIZES = 10.0  # times the diagonal of the place with most lines; buildings of one site lie nearer together
DROPPED_FROM = 1000.0  # m; from there on a few lines are left out
FEW_LINES = 2  # enclose nothing; and this fraction of all lines:
FEW_FRACTION = 0.01


def near_lines(endpoints: Floats, layer_of: Integers, drawing: Drawing) -> Flags:
    """Tell which lines to keep: all but a few that lie far from the others, or are far too long.

    Parameters
    ----------
    endpoints : (n, 4)
        Metres.
    layer_of : (n,)
        Index of each line into the drawing's `polylines`.
    drawing : Drawing
        Its notes take what is left out, by layer and position.

    Raises
    ------
    MalformedFileError
        When the lines lie at several places, too far apart for a map.
    """
    kept: Flags = np.hypot(*(endpoints[:, 2:] - endpoints[:, :2]).T) <= MAX_LENGTH
    if not 0 < int((~kept).sum()) <= _few(len(kept)):
        kept[:] = True  # none, or so many that the unit is wrong: refused as a map
    else:
        where = _named(endpoints, layer_of, ~kept, drawing)
        drawing.notes.add_dropped("long_lines", f"lines longer than {MAX_LENGTH:g} m: {where}", int((~kept).sum()))
    apart = _apart(endpoints, kept)
    near: Flags = kept & (apart == 0.0)
    far = kept & ~near
    if not far.any():
        return kept
    least = float(apart[far].min())
    where = f"{least:.0f} m or more from the others: {_named(endpoints, layer_of, far, drawing)}"
    if far.sum() <= _few(int(kept.sum())) and least >= DROPPED_FROM:
        drawing.notes.add_dropped("far_lines", f"lines {where}", int(far.sum()))
        return near
    corners = endpoints[kept].reshape(-1, 2)
    extent = float((corners.max(axis=0) - corners.min(axis=0)).max())
    if extent > MAX_EXTENT:
        raise MalformedFileError(
            f"its lines lie {extent:.0f} m apart, expected at most {MAX_EXTENT:g} m: "
            f"{_named(endpoints, layer_of, near, drawing)}; and {where}; delete those that are not walls, or set "
            "the option layers"
        )
    drawing.notes.add_assumed("far_lines", f"lines are part of the map, but lie {where}", int(far.sum()))
    return kept


def _few(count: int) -> float:
    return max(FEW_LINES if count > 2 * FEW_LINES else 0, FEW_FRACTION * count)


def _apart(endpoints: Floats, kept: Flags) -> Floats:
    """Return how far the place of each line is from the one with most lines, metres; 0 for what is near its size.

    Lines in cells that touch are one place.
    """
    middles = 0.5 * (endpoints[:, :2] + endpoints[:, 2:])
    cells, cell_of = np.unique(np.floor(middles / APART), axis=0, return_inverse=True)
    cell_of = cell_of.reshape(-1)
    pairs = scipy.spatial.cKDTree(cells).query_pairs(1.0, p=np.inf, output_type="ndarray")
    graph = scipy.sparse.coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(cells), len(cells)))
    _, group_of_cell = scipy.sparse.csgraph.connected_components(graph, directed=False)
    group = group_of_cell[cell_of]
    counts = np.bincount(group[kept], minlength=int(group.max()) + 1)
    first = int(np.argmax(counts))
    own = endpoints[kept & (group == first)].reshape(-1, 2)
    low, high = own.min(axis=0), own.max(axis=0)
    apart = np.hypot(*np.maximum(0.0, np.maximum(low - middles, middles - high)).T)
    nearest = np.full(len(counts), np.inf)
    np.minimum.at(nearest, group, apart)
    is_far = nearest > max(APART, FAR_SIZES * float(np.hypot(*(high - low))))
    is_far[first] = False
    return np.where(is_far, nearest, 0.0)[group]


def _named(endpoints: Floats, layer_of: Integers, some: Flags, drawing: Drawing) -> str:
    """Return how many lines they are, and the layers and the middles of the first."""
    middles = 0.5 * (endpoints[some, :2] + endpoints[some, 2:])
    names = [name for k in np.unique(layer_of[some])[:1000] if (name := drawing.polylines[k].layer)]
    layers = f" on {listed(names)}" if names else ""
    if len(middles) <= MAX_NAMED // 2:
        places = ", ".join(f"({x:.6g}, {y:.6g})" for x, y in middles)
        return f"{len(middles)}{layers} at {places} m"
    x, y = np.median(middles, axis=0)
    return f"{len(middles)}{layers} around ({x:.6g}, {y:.6g}) m"
