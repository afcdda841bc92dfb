"""Estimate the score of chance: by a bound over all poses of the map, and by searching the mirrored scan.

The bound takes walls to be drawn at random. Those have no right angles, no module and no equal rooms. The scan with
left and right exchanged has all of these, and (almost) never was there to be seen: where it scores as high as the
answer, the answer proves nothing.
"""

from __future__ import annotations

import math

from registration.values import value

from ..consensus.consensus_set import ConsensusSet
from ..consensus.ranking import rank_candidates
from ..consensus.tuning import BEAMS_READ
from ..context import SearchContext
from ..scan.scan import mirrored
from ..scan.scan_lines import ScanLines
from ..search.candidates import Effort, allowed_by, find_candidates
from ..tuning import FEW_KEPT
from .kernels import symmetry
from .tuning import NULL_ALLOWED, NULL_ALLOWED_NEAR, NULL_ENOUGH, NULL_FRACTION, NULL_MARGIN, NULL_SAMPLES


@value(frozen=True, slots=True)
class NullScore:
    """The score of the mirrored scan.

    Attributes
    ----------
    score : float
        Of its best explanation anywhere on the map, nats; 0 where none comes near the answer.
    symmetry : float
        Fraction of the map's view from the answer that it also shows mirrored from there, 0 to 1. If that is nearly
        all, the map is symmetric about the place, and the mirrored scan scores by right.
    """

    score: float
    symmetry: float


NO_NULL_SCORE = NullScore(0.0, 0.0)


def find_null_score(context: SearchContext, best: ConsensusSet, least: float = 0.0) -> NullScore:
    """Search the mirrored scan for something that is nearly as good as the answer.

    Parameters
    ----------
    context : SearchContext
    best : ConsensusSet
        Of the answer.
    least : float
        Fraction of the answer's score; a lower score may be returned as none, which takes less of a search.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    other, wanted = _mirrored(context), least * best.score
    near, whole = _efforts(context, best, wanted)
    if near is not None:
        found = rank_candidates(other, find_candidates(other, near).poses)
        if not found or found[0].score < wanted:
            return NO_NULL_SCORE
    found = rank_candidates(other, find_candidates(other, whole).poses)
    return NullScore(found[0].score, symmetry_of(context, best, found[0])) if found else NO_NULL_SCORE


def _mirrored(context: SearchContext) -> SearchContext:
    """Return the search of the mirrored scan, without a prior."""
    one_view = context.scan.views is None
    # The search takes the scan's lines; those of several views are joined again.
    scan = mirrored(context.scan, segments=not one_view)
    lines = context.lines.mirrored() if one_view else ScanLines.of(scan, context.index.sigma, context.options)
    return context.instead(scan, lines)


def _efforts(context: SearchContext, best: ConsensusSet, wanted: float) -> tuple[Effort | None, Effort]:
    """Return how much is searched for a score that is `wanted`, nats, None where that is no less, and for any."""
    allowed, known = allowed_by(context.options), max(0.0, best.by_segments)
    # Beams may add to any pose, so that without them nothing is enough.
    enough = math.inf if context.with_beams else NULL_ENOUGH * known
    whole = Effort(FEW_KEPT, NULL_FRACTION, NULL_FRACTION, max(allowed, NULL_ALLOWED), known, enough, NULL_SAMPLES)
    by_segments = NULL_MARGIN * (wanted - BEAMS_READ if context.with_beams else wanted)
    if not by_segments > NULL_FRACTION * known > 0.0:
        return None, whole
    least = by_segments / known
    return Effort(FEW_KEPT, least, least, max(allowed, NULL_ALLOWED_NEAR), known, enough, NULL_SAMPLES), whole


def symmetry_of(context: SearchContext, best: ConsensusSet, null: ConsensusSet) -> float:
    """Return the fraction of the map's view from an answer that it shows mirrored, at the null's pose, 0 to 1.

    0, as of a map without symmetry, where rays cannot be followed.
    """
    if not context.can_look:
        return 0.0
    seen, places, place = context.lines.sightings, context.sights.places, context.index.tables.place
    poses = best.estimate, null.estimate
    return float(symmetry.mirrored_fraction(places, seen, *poses, context.gates, place, context.workspace))
