"""The freedom that a set of lines takes from a pose, in nats."""

import math

from compiled import kernel
from registration.layout import Record


@kernel
def log_determinant(information: Record, model: Record) -> float:
    """Return ``log(det(1 + F S)) / 2``, nats: what a set of information F is charged for fixing a pose that was free.

    S is the diagonal of the variances of `model`. Without the 1 this is the marginal likelihood's term.
    """
    d = model.free_distance
    a = model.free_angle
    xx = 1.0 + information.xx * d * d
    yy = 1.0 + information.yy * d * d
    tt = 1.0 + information.tt * a * a
    xy = information.xy * d * d
    xt = information.xt * d * a
    yt = information.yt * d * a
    # By elimination: the minors of a set that fixes one direction only cancel to some 1e-4 nats. No pivot is below 1.
    left = yt - xy / xx * xt
    second = max(1.0, yy - xy / xx * xy)
    third = max(1.0, tt - xt / xx * xt - left / second * left)
    return 0.5 * math.log(xx * second * third)
