"""Small arithmetic that several kernels share: angles, fading, gates, grid cells, priors."""

from __future__ import annotations

import math

from compiled import kernel
from registration.layout import Record

from ...layout import HARD_PRIOR, NO_PRIOR
from ...tuning import INSIDE, SOFT_FLOOR


@kernel
def wrap(angle: float) -> float:
    """Return the angle in [-pi, pi]."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@kernel
def angle_gate(line: Record, heading_variance: float, gates: Record) -> float:
    """Return up to which angle to a wall a scan line lies on it, rad, where the heading has a variance, rad^2."""
    deviation = math.sqrt(line.angle_variance + heading_variance)
    return min(gates.greatest_angle, max(gates.least_angle, gates.sigmas * deviation))


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
