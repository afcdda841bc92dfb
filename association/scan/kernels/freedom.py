"""The freedom that a set of lines takes from a pose, in nats."""

import math

from compiled import kernel
from registration.layout import Record


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
