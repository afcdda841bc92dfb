"""The null score: what chance scores on this map, by a search of the mirrored scan."""

from __future__ import annotations

import math

import numpy as np

from registration.layout import Records
from registration.values import value

from ..consensus.beams import cast
from ..consensus.consensus_set import ConsensusSet
from ..consensus.ranking import rank
from ..consensus.tuning import AGREEING, AGREEING_FRACTION
from ..context import SearchContext
from ..layout import BEAM
from ..scan.beams import BeamSet
from ..scan.scan import mirrored
from ..scan.scan_lines import ScanLines
from ..search.search import Effort, allowed_by, search
from ..tuning import FEW_KEPT, RAYS
from .tuning import BEYOND_SYMMETRY, NULL_ALLOWED, NULL_ENOUGH, NULL_FRACTION, SYMMETRIC, UNLIKE_SYMMETRY


@value(frozen=True, slots=True)
class Null:
    """The score of the mirrored scan.

    Attributes
    ----------
    score : float
        Nats; 0 where none was found above `NULL_FRACTION` of the answer's.
    symmetry : float
        Fraction of the map's view from the answer that it shows mirrored at the null's pose, 0 to 1.
    """

    score: float
    symmetry: float

    def ratio(self, best: float) -> float:
        """Return the score over that of the answer, at least `NULL_FRACTION`, less where the place is symmetric.

        A place with a mirror axis shows the mirrored scan as well as the scan: that is no chance. But not better.
        """
        if not best > 0.0:
            return NULL_ENOUGH
        ratio = self.score / best
        symmetric = _between(UNLIKE_SYMMETRY, SYMMETRIC, self.symmetry) * (1.0 - _between(1.0, BEYOND_SYMMETRY, ratio))
        return NULL_FRACTION + max(0.0, ratio - NULL_FRACTION) * (1.0 - symmetric)


def _between(none: float, full: float, value: float) -> float:
    """Return how far a value is from none to full, 0 to 1."""
    return min(1.0, max(0.0, (value - none) / (full - none)))


NO_NULL = Null(0.0, 0.0)


def find_null(context: SearchContext, best: ConsensusSet) -> Null:
    """Search the mirrored scan for something that is nearly as good as the answer.

    The mirrored scan has the building's right angles, its module and its equal rooms, and was (almost) never taken
    there: what it scores is what chance scores here.
    """
    one_view = context.scan.views is None
    # The search takes the scan's lines; those of several views are joined again.
    scan = mirrored(context.scan, segments=not one_view)
    lines = context.lines.mirrored() if one_view else ScanLines.of(scan, context.index.sigma, context.options)
    other = context.anywhere().with_scan(scan, lines)
    known = max(0.0, best.by_pairs)
    # Beams may add to any pose, so that without them nothing is enough.
    enough = math.inf if context.with_beams else NULL_ENOUGH * known
    allowed = max(allowed_by(context.options), NULL_ALLOWED)
    found = rank(other, search(other, Effort(FEW_KEPT, NULL_FRACTION, NULL_FRACTION, allowed, known, enough)).poses)
    return Null(found[0].score, _symmetry(context, best, found[0])) if found else NO_NULL


def _symmetry(context: SearchContext, best: ConsensusSet, null: ConsensusSet) -> float:
    """Return the fraction of directions in which the map shows the same from an answer, and mirrored from the null."""
    x, y = context.sensor
    reach = context.beams.reach
    here = cast(context, _all_round(x, y, reach, 1.0), best.estimate)
    there = cast(context, _all_round(x, -y, reach, -1.0), null.estimate)
    if not context.can_look:
        return 0.0
    away, other = here["distance"][0], there["distance"][0]
    same = np.abs(away - other) < AGREEING + AGREEING_FRACTION * away
    return float(np.mean(same))


def _all_round(x: float, y: float, reach: float, way: float) -> BeamSet:
    """Return beams in all directions from a place, counter-clockwise or (-1) clockwise."""
    angles = way * 2.0 * math.pi * (np.arange(RAYS) + 0.5) / RAYS
    rows: Records = np.zeros(RAYS, BEAM)
    rows["x"], rows["y"], rows["dx"], rows["dy"], rows["range"] = x, y, np.cos(angles), np.sin(angles), np.inf
    nothing = np.zeros(RAYS, np.intp)
    return BeamSet(rows, nothing - 1, nothing, np.ones(RAYS), reach)
