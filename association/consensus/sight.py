"""Check lines of sight at the answer: whether the expected walls were seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from registration.layout import Records
from registration.values import value

from ..context import SearchContext
from ..layout import ESTIMATE, record
from ..tuning import COMPARED_BEAMS
from .beams import beam_evidence_at, rays_of
from .consensus_set import ConsensusSet
from .estimation import EstimatedPose
from .kernels import agreement as agreement_kernels
from .kernels.acceptance import missing_pieces
from .kernels.beams import beam_fractions
from .tuning import NEUTRAL


@value(frozen=True, slots=True)
class BeamFractions:
    """Fractions of the beams that do not read what the map shows.

    Of all beams; 0 without beams.

    Attributes
    ----------
    farther : float
        That read farther than the wall before them: it is not there, or the robot is not.
    nearer : float
        That read nearer: something stands before the wall.
    passed : float
        That passed through a wall; those that end shortly behind it count in part.
    in_step : float
        Mean fraction of an exact view's beams that read the map's walls, over that of all views; 1 if no view is
        uncertain. If it is low, the other views may be placed well, and the scan's frame not.
    """

    farther: float = 0.0
    nearer: float = 0.0
    passed: float = 0.0
    in_step: float = 1.0


NO_BEAMS = BeamFractions()


def missing_segments(context: SearchContext, best: ConsensusSet) -> tuple[int, ...]:
    """List the map segments of walls that rays to the consensus set pass through.

    None without a viewpoint, where rays cannot be followed, and where the deadline has passed and that would take long.
    """
    if context.scan.viewpoint is None or context.too_late_to_look:
        return ()
    index = context.index
    pieces = missing_pieces(
        context.sights, best.matches, best.estimate, index.tables.place, index.pieces, context.workspace
    )
    return tuple(sorted(set((pieces % index.directed).tolist())))


def agreement(context: SearchContext, best: ConsensusSet) -> float:
    """Return the fraction of directions in which the scan shows what the map does, 0 to 1.

    `NEUTRAL` without a viewpoint, and where rays cannot be followed.
    """
    if context.scan.viewpoint is None or not context.can_look:
        return NEUTRAL
    pose, place = best.estimate, context.index.tables.place
    return float(agreement_kernels.agreement(context.sights, pose, place, context.workspace))


def compare_beams(context: SearchContext, estimated: EstimatedPose) -> BeamFractions:
    """Return the fractions of beams that do not read what the map shows from the estimated pose."""
    if not context.with_beams or not context.can_look:
        return NO_BEAMS
    pose, index = estimated.pose, context.index
    at = record(ESTIMATE, x=pose.x, y=pose.y, theta=pose.theta)
    fractions = beam_fractions(
        rays_of(context, COMPARED_BEAMS), at, index.tables.place, index.obstacles, context.workspace
    )
    return BeamFractions(*fractions, _in_step(context, at))


def _in_step(context: SearchContext, at: Records) -> float:
    views, beams = context.scan.views, context.scan.beams
    if views is None or beams is None or beams.origins is None or not views.uncertain:
        return 1.0
    exact = ~views.root.reshape(len(views), -1).any(axis=1)
    if not exact.any() or context.deadline.passed:
        return 1.0
    reads = []
    for view in range(len(views)):
        own = views.of_beam == view
        alone = replace(beams, angles=beams.angles[own], ranges=beams.ranges[own], origins=beams.origins[own])
        of_view = replace(context, scan=replace(context.scan, beams=alone))
        reads.append(float(beam_evidence_at(of_view, at, COMPARED_BEAMS, 0)["read"][0]))
    every = float(np.mean(reads))
    return float(np.mean(np.array(reads)[exact])) / every if every > 0.0 else 1.0
