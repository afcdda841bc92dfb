"""The null score: what chance scores on this map, by a search of the mirrored scan."""

from __future__ import annotations

import math

from ..consensus.consensus_set import ConsensusSet
from ..consensus.ranking import rank
from ..context import SearchContext
from ..scan.scan import mirrored
from ..scan.scan_lines import ScanLines
from ..search.search import Effort, allowed_by, search
from ..tuning import FEW_KEPT
from .tuning import NULL_ALLOWED, NULL_ENOUGH, NULL_FRACTION


def find_null(context: SearchContext, best: ConsensusSet) -> float:
    """Return the score of the mirrored scan, nats; 0 where it is not above `NULL_FRACTION` of the answer's.

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
    return found[0].score if found else 0.0
