"""Lines of sight at the answer: what should have been seen, and whether it was."""

from __future__ import annotations

import numpy as np

from ._agreement_kernels import NEUTRAL
from ._agreement_kernels import agreement as agreement_at
from ._sight_kernels import BLOCKING_RAYS, SIGHT_TOLERANCE, count_blockers
from .map_index import MapIndex
from .options import Scan
from .ranking import Ranked
from .scan_rows import ScanRows


def missing_walls(index: MapIndex, scan: Scan, rows: ScanRows, best: Ranked) -> tuple[int, ...]:
    """List the map segments of walls that rays to the consensus set pass through; none without a viewpoint."""
    if scan.viewpoint is None:
        return ()
    m = len(index.walls.rows)
    to_matched, to_clutter = np.zeros(m, dtype=np.int64), np.zeros(m, dtype=np.int64)
    pose = np.array([best.pose.theta, best.pose.x, best.pose.y])
    count_blockers(
        rows.rows, best.matches, np.array(scan.viewpoint), pose, index.walls.rows, index.grid.starts, index.grid.items,
        index.grid.shape, SIGHT_TOLERANCE, to_matched, to_clutter, np.empty(m, dtype=np.int64),
    )  # fmt: skip
    # A wall that holds part of the consensus set was seen, and at a grazing angle rays to its neighbour pass its end.
    seen = best.matches[:, 0].astype(np.intp)
    to_matched[seen[seen >= 0]] = 0
    walls = np.nonzero(to_matched >= BLOCKING_RAYS / 2)[0]
    pieces = [index.pieces[index.piece_starts[w] : index.piece_starts[w + 1]] for w in walls]
    return tuple(sorted({int(p) % index.directed for group in pieces for p in group}))


def agreement(index: MapIndex, scan: Scan, rows: ScanRows, best: Ranked) -> float:
    """Return the share of directions in which the scan shows what the map does, 0 to 1; see `_agreement_kernels`."""
    if scan.viewpoint is None:
        return NEUTRAL
    x, y = scan.viewpoint
    pose = best.pose
    return float(
        agreement_at(
            rows.rows, x, y, pose.theta, pose.x, pose.y, index.walls.rows, index.grid.starts, index.grid.items,
            index.grid.shape,
        )
    )  # fmt: skip
