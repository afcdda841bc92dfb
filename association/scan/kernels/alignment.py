"""Compiled search for lines that two views show of one wall."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import Integers
from ...tuning import MODEL_ANGLE, ROUGHNESS
from ..tuning import ALIGNED_VIEWS, GATE_SIGMAS, LEAST_ALIGNED, LEAST_SPREAD, MOST_APART, MOST_TURNED, SAME_LINE


@kernel
def overlap_middle(one: Record, other: Record) -> tuple[float, float]:
    """Return the abscissa on `other`, from its middle, of the middle of what both cover, and how much that is."""
    middle = other.dx * (one.x - other.x) + other.dy * (one.y - other.y)
    low = max(middle - 0.5 * one.length, -0.5 * other.length)
    high = min(middle + 0.5 * one.length, 0.5 * other.length)
    return 0.5 * (low + high), high - low


@kernel
def offset_at(one: Record, other: Record, x: float, y: float) -> float:
    """Return how far `one` lies to the left of `other`, metres, at a place on that."""
    along = one.dx * (x - one.centroid_x) + one.dy * (y - one.centroid_y)
    return other.dx * (one.centroid_y + along * one.dy - y) - other.dy * (one.centroid_x + along * one.dx - x)


@kernel
def variance_at(line: Record, x: float, y: float) -> float:
    """Return the variance of a line's offset at the point of it nearest to a place, m^2."""
    along = line.dx * (x - line.centroid_x) + line.dy * (y - line.centroid_y)
    return ROUGHNESS**2 + line.variance * (1.0 + along * along / max(line.spread, LEAST_SPREAD))


@kernel
def angle_variance(line: Record) -> float:
    """Return the variance of a line's angle, rad^2."""
    return MODEL_ANGLE**2 + line.variance / max(line.spread, LEAST_SPREAD)


@kernel
def step_variance(
    covariance: Floats, one: int, other: int, line: Record, x: float, y: float, places: Records
) -> tuple[float, float]:
    """Return the variances of an offset from `line` at a place, and of an angle, by the uncertainty of two views."""
    g = np.empty(6, np.float64)
    for k in range(2):
        v = one if k == 0 else other
        sign = 1.0 if k == 0 else -1.0
        g[3 * k] = -sign * line.dy
        g[3 * k + 1] = sign * line.dx
        g[3 * k + 2] = sign * (line.dx * (x - places[v].x) + line.dy * (y - places[v].y))
    offset = 0.0
    for i in range(6):
        p = 3 * one + i if i < 3 else 3 * other + i - 3
        for j in range(6):
            q = 3 * one + j if j < 3 else 3 * other + j - 3
            offset += g[i] * covariance[p, q] * g[j]
    angle = covariance[3 * one + 2, 3 * one + 2] + covariance[3 * other + 2, 3 * other + 2]
    angle -= 2.0 * covariance[3 * one + 2, 3 * other + 2]
    return max(0.0, offset), max(0.0, angle)


@kernel
def pair_lines(lines: Records, starts: Integers, places: Records, covariance: Floats) -> Integers:
    """Pair lines of each view with those of the views before it that alone they can be, (k, 2).

    Two can be one if they run the same way, have enough in common, and lie within the error of both and of their views.
    A line that can be two of another view, which are farther apart than one wall is, is none of them there.
    Each is paired at most once, with the nearest view before its own.

    Parameters
    ----------
    lines : (n,) of `LINE_PARTS`, view by view
    starts : (v + 1,) where each view begins
    places : (v,) of `POINT`, of the views
    covariance : (3 v, 3 v) of additive x, y, theta of the views' poses
    """
    pairs = np.empty((len(lines), 2), np.int64)
    count = 0
    for v in range(1, len(starts) - 1):
        for i in range(starts[v], starts[v + 1]):
            for u in range(v - 1, max(-1, v - 1 - ALIGNED_VIEWS), -1):
                nearest, apart = nearest_line(lines[i], v, lines[starts[u] : starts[u + 1]], u, places, covariance)
                if nearest >= 0 and apart <= SAME_LINE:
                    pairs[count, 0] = i
                    pairs[count, 1] = starts[u] + nearest
                    count += 1
                    break
    return pairs[:count]


@kernel
def nearest_line(
    one: Record, v: int, others: Records, u: int, places: Records, covariance: Floats
) -> tuple[int, float]:
    """Return which line of view u is the nearest of those that a line of view v can be, by its deviation; -1 for none.

    And between which offsets from it all of these lie, metres.
    """
    nearest = -1
    least = math.inf
    low = math.inf
    high = -math.inf
    for j in range(len(others)):
        offset, noise = offset_if_one(one, v, others[j], u, places, covariance)
        if offset < math.inf:
            low = min(low, offset)
            high = max(high, offset)
            if abs(offset) / math.sqrt(noise) < least:
                least = abs(offset) / math.sqrt(noise)
                nearest = j
    return nearest, high - low


@kernel
def offset_if_one(
    one: Record, v: int, other: Record, u: int, places: Records, covariance: Floats
) -> tuple[float, float]:
    """Return how far a line of view v lies from one of view u if both can be one, metres, else inf; and its variance.

    The variance, m^2, is that of the lines alone.
    """
    sine = other.dx * one.dy - other.dy * one.dx
    if abs(sine) > MOST_TURNED or other.dx * one.dx + other.dy * one.dy <= 0.0:
        return math.inf, 0.0
    at, common = overlap_middle(one, other)
    if common < min(LEAST_ALIGNED, 0.5 * min(one.length, other.length)):
        return math.inf, 0.0
    x = other.x + at * other.dx
    y = other.y + at * other.dy
    offset = offset_at(one, other, x, y)
    noise = variance_at(one, x, y) + variance_at(other, x, y)
    steps, turns = step_variance(covariance, v, u, other, x, y, places)
    if abs(offset) > min(MOST_APART, GATE_SIGMAS * math.sqrt(noise + steps)):
        return math.inf, 0.0
    if abs(sine) > GATE_SIGMAS * math.sqrt(angle_variance(one) + angle_variance(other) + turns):
        return math.inf, 0.0
    return offset, noise
