"""Compiled score of a pose by a prior."""

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import HARD_PRIOR, NO_PRIOR
from ...tuning import INSIDE, SOFT_FLOOR
from .geometry import wrap


@kernel
def prior_value(prior: Record, pose: Record) -> float:
    """Return the score of a pose by the prior, nats: at most 0 for a soft one, `INSIDE` or 0 for a hard one."""
    if prior.kind == NO_PRIOR:
        return 0.0
    dx = pose.x - prior.x
    dy = pose.y - prior.y
    turn = wrap(pose.theta - prior.theta)
    if prior.kind == HARD_PRIOR:
        return INSIDE if dx * dx + dy * dy <= prior.radius * prior.radius and abs(turn) <= prior.angle else 0.0
    square = (
        prior.xx * dx * dx
        + 2.0 * prior.xy * dx * dy
        + 2.0 * prior.xt * dx * turn
        + prior.yy * dy * dy
        + 2.0 * prior.yt * dy * turn
        + prior.tt * turn * turn
    )
    return max(SOFT_FLOOR, -0.5 * square)


@kernel
def prior_values(prior: Records, poses: Records) -> Floats:
    """Return the scores of poses, (k,), by the prior (1,), nats."""
    values = np.empty(len(poses), np.float64)
    for k in range(len(poses)):
        values[k] = prior_value(prior[0], poses[k])
    return values
