"""Lines of sight at the answer: what should have been seen, and whether it was."""

from __future__ import annotations

from dataclasses import dataclass

from .context import SearchContext
from .kernels.acceptance import missing_pieces
from .kernels.agreement import agreement as agreement_at
from .kernels.beams import beam_shares
from .layout import ESTIMATE, record
from .ranking import Ranked, rays_of
from .settling import Settled
from .tuning import COMPARED_BEAMS, NEUTRAL


@dataclass(frozen=True, slots=True)
class BeamShares:
    """Shares of the beams that do not read what the map shows; both 0 without beams.

    Attributes
    ----------
    farther : float
        That read farther than the wall before them: it is not there, or the robot is not.
    nearer : float
        That read nearer: something stands before the wall.
    """

    farther: float = 0.0
    nearer: float = 0.0


def missing_segments(context: SearchContext, best: Ranked) -> tuple[int, ...]:
    """List the map segments of walls that rays to the consensus set pass through; none without a viewpoint."""
    if context.scan.viewpoint is None:
        return ()
    index = context.index
    pieces = missing_pieces(
        context.sights, best.matches, best.estimate, index.tables.place, index.pieces, context.workspace
    )
    return tuple(sorted(set((pieces % index.directed).tolist())))


def agreement(context: SearchContext, best: Ranked) -> float:
    """Return the share of directions in which the scan shows what the map does, 0 to 1."""
    if context.scan.viewpoint is None:
        return NEUTRAL
    pose, place = best.estimate, context.index.tables.place
    return float(agreement_at(context.sights, pose, place, context.workspace))


def compare_beams(context: SearchContext, settled: Settled) -> BeamShares:
    """Return how many beams do not read what the map shows from the settled pose."""
    if not context.with_beams:
        return BeamShares()
    pose, place = settled.pose, context.index.tables.place
    at = record(ESTIMATE, x=pose.x, y=pose.y, theta=pose.theta)
    farther, nearer = beam_shares(rays_of(context, COMPARED_BEAMS), at, place, context.workspace)
    return BeamShares(farther, nearer)
