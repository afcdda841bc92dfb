"""Single beams as evidence: which of them read the wall that they should at a pose."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from registration.layout import Floats, Records

from ..context import SearchContext
from ..layout import BEAM, BEAM_EVIDENCE
from ..tables import Rays
from ..tuning import MOST_LOOKED_AT
from .kernels.beams import weigh_beams
from .tuning import BEAMS_PASSED, BEAMS_READ


def beam_evidence_at(context: SearchContext, poses: Records, most: int, refined: int) -> Records:
    """Return the evidence of at most `most` of the beams at each pose, (k,) of `BEAM_EVIDENCE`.

    Moves the first `refined` of the poses. The evidence of poses not reached before the deadline is 0, and all of it if
    rays cannot be followed.
    """
    evidence, rays = np.zeros(len(poses), BEAM_EVIDENCE), rays_of(context, most)
    place, obstacles = context.index.tables.place, context.index.obstacles
    step = max(1, int(MOST_LOOKED_AT / (1.0 + context.looks)))
    for begin in range(0, len(poses) if context.can_look else 0, step):
        if begin > 0 and context.deadline.passed:
            break
        some, moved = slice(begin, begin + step), max(0, refined - begin)
        weigh_beams(rays, poses[some], place, obstacles, moved, context.workspace, evidence[some])
    return evidence


def rays_of(context: SearchContext, most: int) -> Rays:
    """Return at most `most` of the beams of which something is known, evenly spread."""
    beams = context.scan.beams
    assert beams is not None
    known = np.flatnonzero(~np.isnan(beams.ranges))
    chosen = known[:: max(1, math.ceil(len(known) / most))]
    begins = (context.scan.viewpoint or (0.0, 0.0)) if beams.origins is None else beams.origins[chosen].T
    return Rays(beam_rows(begins, beams.angles[chosen], beams.ranges[chosen]), beams.range_max)


def beam_rows(begins: ArrayLike, angles: Floats, ranges: Floats) -> Records:
    """Return beams as records (n,) of `BEAM`, of where they begin, (2,) for all of them or (2, n), m."""
    rows = np.empty(len(angles), BEAM)
    rows["x"], rows["y"] = np.asarray(begins)
    rows["dx"], rows["dy"], rows["range"] = np.cos(angles), np.sin(angles), ranges
    return rows


def beam_score(evidence: Records) -> Floats:
    """Return the term of beams in the score of each pose, nats, over one where none reads what it should."""
    return np.asarray(BEAMS_READ * evidence["read"] - BEAMS_PASSED * evidence["passed"])
