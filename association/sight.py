"""Lines of sight at the answer: what should have been seen, and whether it was."""

from __future__ import annotations

from .context import SearchContext
from .kernels.acceptance import missing_pieces
from .kernels.agreement import agreement as agreement_at
from .ranking import Ranked
from .tuning import NEUTRAL


def missing_segments(context: SearchContext, best: Ranked) -> tuple[int, ...]:
    """List the map segments of walls that rays to the consensus set pass through; none without a viewpoint."""
    if context.scan.viewpoint is None:
        return ()
    index = context.index
    pieces = missing_pieces(
        context.lines.rows, best.matches, context.view, best.estimate, index.tables.place, index.pieces,
        context.workspace,
    )  # fmt: skip
    return tuple(sorted(set((pieces % index.directed).tolist())))


def agreement(context: SearchContext, best: Ranked) -> float:
    """Return the share of directions in which the scan shows what the map does, 0 to 1."""
    if context.scan.viewpoint is None:
        return NEUTRAL
    pose, place = best.estimate, context.index.tables.place
    return float(agreement_at(context.lines.rows, context.view, pose, place, context.workspace))
