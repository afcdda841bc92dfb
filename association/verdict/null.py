"""The null of an answer: what chance scores in this building, measured by the mirrored scan.

Walls drawn at random have no right angles, no module and no equal rooms. The scan with left and right exchanged has all
of these, and (almost) never was there to be seen: where it scores as high as the answer, the answer proves nothing.
"""

from __future__ import annotations

import math

from registration.values import value

from ..consensus.ranking import Ranked, rank_candidates
from ..context import SearchContext
from ..scan.scan import mirrored
from ..scan.scan_lines import ScanLines
from ..search.candidates import Effort, allowed_by, find_candidates
from ..tuning import (
    BEAMS_READ,
    NULL_ALLOWED,
    NULL_ALLOWED_NEAR,
    NULL_ENOUGH,
    NULL_KEPT,
    NULL_MARGIN,
    NULL_SAMPLES,
    NULL_SHARE,
)
from .kernels import symmetry

_mirrored_share = symmetry.mirrored_share


@value(frozen=True, slots=True)
class Null:
    """What the mirrored scan comes to.

    Attributes
    ----------
    score : float
        Of its best explanation anywhere on the map, nats; 0 where none comes near the answer.
    symmetry : float
        How much of what the map shows from the answer it shows mirrored from there, 0 to 1: where that is nearly all,
        the map is symmetric about the place, and the null scores by right.
    """

    score: float
    symmetry: float


def null_of(context: SearchContext, best: Ranked, share: float = 0.0) -> Null:
    """Search the mirrored scan for something that is nearly as good as the answer.

    Where it comes to less than `share` of the answer's score it may be told to be none, which takes less of a search.
    """
    one_view = context.scan.views is None
    # What is searched are its lines; those of several views are joined anew.
    scan = mirrored(context.scan, segments=not one_view)
    lines = context.lines.mirrored() if one_view else ScanLines.of(scan, context.index.sigma, context.options)
    other = context.instead(scan, lines)
    allowed = allowed_by(context.options)
    known, wanted = max(0.0, best.by_segments), share * best.score
    # Beams may add to any pose, so that without them nothing is enough.
    enough = math.inf if context.with_beams else NULL_ENOUGH * known
    by_segments = NULL_MARGIN * (wanted - BEAMS_READ if context.with_beams else wanted)
    if by_segments > NULL_SHARE * known > 0.0:
        least = by_segments / known
        near = Effort(NULL_KEPT, least, least, max(allowed, NULL_ALLOWED_NEAR), known, enough, NULL_SAMPLES)
        found = rank_candidates(other, find_candidates(other, near))
        if not found or found[0].score < wanted:
            return Null(0.0, 0.0)
    effort = Effort(NULL_KEPT, NULL_SHARE, NULL_SHARE, max(allowed, NULL_ALLOWED), known, enough, NULL_SAMPLES)
    found = rank_candidates(other, find_candidates(other, effort))
    return Null(found[0].score, symmetry_of(context, best, found[0])) if found else Null(0.0, 0.0)


def symmetry_of(context: SearchContext, best: Ranked, null: Ranked) -> float:
    """Return how much of what the map shows from an answer it shows mirrored from there, at the null's pose, 0 to 1.

    0, as of a map without symmetry, where rays cannot be followed.
    """
    if not context.can_look:
        return 0.0
    seen, places, place = context.lines.sightings, context.sights.places, context.index.tables.place
    poses = best.estimate, null.estimate
    return float(_mirrored_share(places, seen, *poses, context.gates, place, context.workspace))
