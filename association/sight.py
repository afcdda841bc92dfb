"""Lines of sight at the answer: what should have been seen, and whether it was."""

from __future__ import annotations

from ._accept_kernels import missing_pieces
from ._agreement_kernels import NEUTRAL
from ._agreement_kernels import agreement as agreement_at
from .map_index import MapIndex
from .options import Scan
from .ranking import Ranked
from .scan_rows import ScanRows


def missing_walls(index: MapIndex, scan: Scan, rows: ScanRows, best: Ranked) -> tuple[int, ...]:
    """List the map segments of walls that rays to the consensus set pass through; none without a viewpoint."""
    if scan.viewpoint is None:
        return ()
    x, y = scan.viewpoint
    pose = best.pose
    pieces = missing_pieces(
        rows.rows, best.matches, float(x), float(y), pose.theta, pose.x, pose.y, index.walls.rows, index.grid.starts,
        index.grid.items, index.grid.shape, index.pieces, index.piece_starts,
    )  # fmt: skip
    return tuple(sorted(set((pieces % index.directed).tolist())))


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
