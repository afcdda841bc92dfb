"""The null of an answer: what chance scores in this building, measured by the mirrored scan.

Walls drawn at random have no right angles, no module and no equal rooms. The scan with left and right exchanged has all
of these, and (almost) never was there to be seen: where it scores as high as the answer, the answer proves nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from .candidates import Effort, find_candidates
from .context import SearchContext
from .kernels.symmetry import mirrored_share
from .ranking import Ranked, rank_candidates
from .scan import mirrored
from .scan_lines import ScanLines
from .tuning import NULL_CONFIDENCE, NULL_ENOUGH, NULL_KEPT, NULL_SHARE


@dataclass(frozen=True, slots=True)
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


def null_of(context: SearchContext, best: Ranked) -> Null:
    """Search the mirrored scan for something that is nearly as good as the answer."""
    scan = mirrored(context.scan)
    # The index is the one that the options want already.
    lines = ScanLines.of(scan, context.index.sigma, context.options)
    options = replace(context.options, confidence=min(context.options.confidence, NULL_CONFIDENCE), exhaustive=False)
    other = replace(context, scan=scan, lines=lines, prior=None, options=options)
    known = max(0.0, best.by_segments)
    # Beams may add to any pose, so that without them nothing is enough.
    effort = Effort(NULL_KEPT, NULL_SHARE, NULL_SHARE, known, math.inf if context.with_beams else NULL_ENOUGH * known)
    ranked = rank_candidates(other, find_candidates(other, effort))
    if not ranked:
        return Null(0.0, 0.0)
    return Null(ranked[0].score, _symmetry(context, best, ranked[0]))


def _symmetry(context: SearchContext, best: Ranked, null: Ranked) -> float:
    seen, places = context.lines.sightings, context.sights.places
    at = places[seen["sensor"]]
    reach = float(np.max(np.hypot(seen["x"] - at["x"], seen["y"] - at["y"]) + 0.5 * seen["length"]))
    place = context.index.tables.place
    return float(mirrored_share(places, best.estimate, reach, null.estimate, context.gates, place, context.workspace))
