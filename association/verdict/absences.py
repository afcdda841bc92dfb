"""Weigh what a scan does not show at an alternative: things of the map that beams miss or pass through."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from registration.layout import Floats

from ..consensus.beams import rays_of
from ..consensus.consensus_set import ConsensusSet
from ..consensus.tuning import MOST_BEAMS
from ..context import SearchContext
from ..index.tuning import MERGE_GAP
from ..tables import Rays
from .kernels.absences import limit_by_things, read_beams
from .tuning import ABSENCE


def absences(context: SearchContext, best: ConsensusSet, others: Sequence[ConsensusSet]) -> Floats:
    """Return the most that beams may count against each alternative, (k,) nats; 0 without beams or time.

    Beams that speak against an alternative more than against the answer belong to one thing where their ends are near
    one another, as pieces of one wall are. Each thing counts `ABSENCE` at most.
    """
    if not len(others) or not context.with_beams or not context.can_look or context.deadline.passed:
        return np.zeros(len(others))
    rays = rays_of(context, MOST_BEAMS)
    here = _readings(context, rays, best)
    return np.array([limit_by_things(rays, here, _readings(context, rays, one), MERGE_GAP, ABSENCE) for one in others])


def _readings(context: SearchContext, rays: Rays, one: ConsensusSet) -> Floats:
    """Return for each beam what `read_beams` writes of it at a pose, (n, 2)."""
    readings = np.zeros((len(rays.beams), 2))
    read_beams(rays, one.estimate, context.index.tables.place, context.workspace, readings)
    return readings
