"""Small arithmetic that several kernels share: angles, gates, priors, freedom."""

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


@kernel
def log_determinant(information: Record, model: Record, c: float, s: float) -> float:
    """Return ``log(det(1 + F S)) / 2``, nats: what a set of information F is charged for fixing a pose that was free.

    F is that of the sensor's place and of the heading, of cosine c and sine s; `information` is that of the scan's
    origin. S is the diagonal of the variances of `model`. Without the 1 this is the marginal likelihood's term.
    """
    x = c * model.sensor_x - s * model.sensor_y
    y = s * model.sensor_x + c * model.sensor_y
    one = information
    d = model.free_distance
    a = model.free_angle
    xx = 1.0 + one.xx * d * d
    yy = 1.0 + one.yy * d * d
    xy = one.xy * d * d
    xt = (one.xt + y * one.xx - x * one.xy) * d * a
    yt = (one.yt + y * one.xy - x * one.yy) * d * a
    tt = one.tt + 2.0 * (y * one.xt - x * one.yt) + y * y * one.xx - 2.0 * x * y * one.xy + x * x * one.yy
    tt = 1.0 + tt * a * a
    # By elimination: the minors of a set that fixes one direction only cancel to some 1e-4 nats. No pivot is below 1.
    left = yt - xy / xx * xt
    second = max(1.0, yy - xy / xx * xy)
    third = max(1.0, tt - xt / xx * xt - left / second * left)
    return 0.5 * math.log(xx * second * third)
