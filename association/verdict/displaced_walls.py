"""Evaluate whether walls of the scan are decimetres away from those of the map."""

from __future__ import annotations

import numpy as np

from ..consensus.consensus_set import ConsensusSet
from ..context import SearchContext
from .kernels.displaced_walls import displaced_length


def displaced_walls(context: SearchContext, best: ConsensusSet) -> float:
    """Return the fraction of the scan's length that is parallel to a wall at 0.1 to 0.35 m from it; 0 to 1.

    On a map that is distorted, or that shows the middle of walls for their faces, a pose may fit some walls to
    millimetres and miss all others by decimetres. The covariance does not contain that error.

    0 where the views of a drive are not exact: their walls are off by the errors of the steps between them. Likewise
    where too many walls lie in one place.
    """
    views = context.scan.views
    if context.too_late_to_look or (views is not None and views.uncertain):
        return 0.0
    scan = context.lines.rows
    length = displaced_length(scan, best.matches, best.estimate, context.index.tables.place)
    return float(length / np.sum(scan["length"]))
