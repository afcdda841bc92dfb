"""Evaluate how well the walls determine a pose, and choose a pose along a direction that they leave open."""

from __future__ import annotations

import numpy as np

from registration import RigidTransform

from ..consensus.consensus_set import ConsensusSet
from ..context import SearchContext
from ..explanations import Answer


def choose_along_direction(context: SearchContext, answer: Answer) -> RigidTransform:
    """Choose among poses that differ along the unobservable direction only; a pose that is fixed, if weakly, is that.

    The nearest to the prior, else to where the raw beams fit best. Without either it is the one that centres the
    observed segments on the walls that they matched.
    """
    pose, direction = answer.pose, answer.estimate.direction
    if not answer.estimate.free:
        return pose
    anchor = _anchor(context, answer.best)
    u = np.array(direction)
    if anchor is None:
        shift = _centring_shift(context, answer, pose, direction)
    else:
        shift = float(np.array([anchor.x - pose.x, anchor.y - pose.y]) @ u)
    return RigidTransform(pose.x + shift * direction[0], pose.y + shift * direction[1], pose.theta)


def _anchor(context: SearchContext, best: ConsensusSet) -> RigidTransform | None:
    """Return the pose that picks one along the direction: the prior, else where the raw beams fit best, else None."""
    prior = context.pose_prior
    if prior is not None and context.on_map_of(prior.pose, best.pose):
        return prior.pose
    return context.in_map(best.pose) if context.with_beams else None


def _centring_shift(
    context: SearchContext, answer: Answer, pose: RigidTransform, direction: tuple[float, float]
) -> float:
    """Return the shift along the direction that puts the middle of the observed lines on that of their walls."""
    u, matched = np.array(direction), answer.best.matched
    walls = context.index.walls.rows[answer.best.matches["wall"][matched]]
    d = np.stack([walls["dx"], walls["dy"]], axis=1)
    normals = np.stack([-d[:, 1], d[:, 0]], axis=1)
    spans = np.stack([walls["begin"], walls["end"]], axis=1)
    ends = d[:, None] * spans[:, :, None]
    ends = ends + normals[:, None] * walls["offset"][:, None, None] + context.index.origin
    seen = context.lines.rows[matched]
    middles, towards = np.stack([seen["x"], seen["y"]], axis=1), np.stack([seen["dx"], seen["dy"]], axis=1)
    half = 0.5 * seen["length"][:, None] * towards
    points = pose.apply(np.stack([middles - half, middles + half], axis=1))
    on_map, on_scan = ends @ u, points @ u
    return 0.5 * float(on_map.min() + on_map.max() - on_scan.min() - on_scan.max())
