"""Angles, and the gates that a scan line has to pass to lie on a wall at a pose."""

import math

from compiled import kernel
from registration.layout import Record

from ...tuning import DIRECTION_BINS

BINS_PER_RADIAN = DIRECTION_BINS / (2.0 * math.pi)
GATE_MARGIN = 1.01  # over a gate: angles are tested by a cosine to the second order


@kernel
def wrap(angle: float) -> float:
    """Return the angle in [-pi, pi]."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@kernel
def rotated(x: float, y: float, c: float, s: float) -> tuple[float, float]:
    """Return a vector rotated by an angle of cosine c and sine s."""
    return c * x - s * y, s * x + c * y


@kernel
def offset_gate(line: Record, estimate: Record, gates: Record, lever: float, dx: float, dy: float) -> float:
    """Return up to which offset from a wall a scan line lies on it, metres.

    The gate is that of the innovation: with ``g = (n, n . J R m)``, the derivative of the offset by the pose, and the
    covariance C of the pose, `sigmas` times the root of ``sigma^2 + g' C g``. ``(dx, dy)`` is the direction of the line
    at the pose, and `lever` its abscissa from the sensor, m.
    """
    variance = (
        dy * dy * estimate.xx
        - 2.0 * dx * dy * estimate.xy
        + dx * dx * estimate.yy
        + 2.0 * lever * (dx * estimate.yt - dy * estimate.xt)
        + lever * lever * estimate.tt
    )
    deviation = math.sqrt(line.offset_variance + max(variance, 0.0))
    return min(gates.greatest_offset, max(gates.least_offset, gates.sigmas * deviation))


@kernel
def angle_gate(line: Record, heading_variance: float, gates: Record) -> float:
    """Return up to which angle to a wall a scan line lies on it, rad, where the heading has a variance, rad^2."""
    deviation = math.sqrt(line.angle_variance + heading_variance)
    return min(gates.greatest_angle, max(gates.least_angle, gates.sigmas * deviation))


@kernel
def bins_about(direction: float, gate: float) -> tuple[int, int]:
    """Return the first and the last direction bin of walls whose direction is within a gate of another, both in rad."""
    turned = (direction + math.pi) * BINS_PER_RADIAN
    spread = GATE_MARGIN * gate * BINS_PER_RADIAN
    return math.floor(turned - spread) % DIRECTION_BINS, math.floor(turned + spread) % DIRECTION_BINS


@kernel
def cell_about(shape: Record, x: float, y: float) -> int:
    """Return the number of the cell of a grid that contains a point, -1 outside of the grid."""
    per_cell = 1.0 / shape.cell
    fx = (x - shape.x0) * per_cell
    fy = (y - shape.y0) * per_cell
    if fx >= 0.0 and fy >= 0.0 and fx < shape.columns and fy < shape.rows:
        return int(fy) * shape.columns + int(fx)
    return -1
