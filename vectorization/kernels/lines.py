"""Maximum likelihood lines: their fit, and whether two pieces or two lines are one."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from compiled import kernel
from registration.kernels import keep_alive
from registration.layout import Record, Records

from ..layout import FITTED, SUMS
from ..tuning import (
    BREAK_PENALTY,
    FIT_STEPS,
    FLATNESS,
    JOINT_FITS,
    LEAST_COSINE,
    LEAST_POINTS,
    NEAR_PARALLEL,
    POINT_GATE,
    SETTLED,
    SKIPPED,
    SKIPPED_STEPS,
)
from .pieces import add, line_cost, subtract


class Weighed(NamedTuple):
    """Points near a line, weighted by their information."""

    number: int
    weight: float  # 1/m^2
    abscissa: float  # m, mean, from the line's mean
    distance: float  # m, mean
    abscissa2: float  # squares about the mean, weighted
    product: float  # of abscissa and distance about their means, weighted
    chi2: float


@kernel
def distance_from(line: Record, point: Record) -> float:
    """Return the signed distance of a point from a line, metres, positive behind it as seen from the sensor."""
    return line.nx * point.x + line.ny * point.y - line.p


@kernel
def abscissa_on(line: Record, x: float, y: float) -> float:
    """Return the abscissa of a place on a line, metres."""
    return line.nx * y - line.ny * x


@kernel
def incidence(line: Record, point: Record) -> float:
    """Return the cosine between a point's ray and a line's normal, 1 where noise has no direction."""
    if point.ray_x == 0.0 and point.ray_y == 0.0:
        return 1.0
    return line.nx * point.ray_x + line.ny * point.ray_y


@kernel
def line_of(sums: Record, line: Record) -> None:
    """Write unit normal and distance (not negative) of the total least squares line of sums to `line`."""
    n = sums.count
    mx = sums.x / n
    my = sums.y / n
    cxx = sums.xx - n * mx * mx
    cxy = sums.xy - n * mx * my
    cyy = sums.yy - n * my * my
    angle = 0.5 * math.atan2(2.0 * cxy, cxx - cyy)
    nx = -math.sin(angle)
    ny = math.cos(angle)
    p = nx * mx + ny * my
    line.nx = -nx if p < 0.0 else nx
    line.ny = -ny if p < 0.0 else ny
    line.p = -p if p < 0.0 else p


@kernel
def fit_line(points: Records, a: int, b: int, scanner: Record, line: Record, own: NDArray[np.bool_]) -> bool:
    """Move `line` to the maximum likelihood one of the points a to b - 1 that lie within the gate.

    Range noise acts along the ray: with the wall at distance p, minimise ``sum (r - p / (n.u))^2 / v`` by Gauss-Newton,
    whose abscissae are where the rays meet the line. Points without ray count with their distance from the line.
    Marks the points used in `own`; returns whether there are any two apart.
    """
    scale = 2.0
    for turn in range(FIT_STEPS):
        of = weigh(points, a, b, scanner, line, own, POINT_GATE * POINT_GATE * scale)
        if of.number < 2 or not of.abscissa2 > 0.0:
            return False
        line.middle += of.abscissa
        line.spread = of.abscissa2 / of.weight
        line.weight = of.weight
        line.count = of.number
        line.chi2 = of.chi2
        if turn == 0:
            scale = max(1.0, of.chi2 / max(1, of.number - 2))
        slope = of.product / of.abscissa2
        offset = line.p + of.distance
        # Turn about the mean: the normal by -slope, the mean point moves along the normal alone.
        c = 1.0 / math.sqrt(1.0 + slope * slope)
        s = slope * c
        nx = c * line.nx + s * line.ny
        ny = c * line.ny - s * line.nx
        p = c * offset - s * line.middle
        line.middle = c * line.middle + s * offset
        line.nx = nx
        line.ny = ny
        line.p = p
        if turn > 1 and slope * slope * of.abscissa2 + of.distance * of.distance * of.weight < SETTLED:
            break
    return True


@kernel
def weigh(
    points: Records, a: int, b: int, scanner: Record, line: Record, own: NDArray[np.bool_], gate: float
) -> Weighed:
    """Sum up the points a to b - 1 whose squared distance from the line is within `gate` variances; set its ends."""
    w_sum = 0.0
    t_sum = 0.0
    e_sum = 0.0
    tt = 0.0
    te = 0.0
    ee = 0.0
    count = 0
    line.begin = math.inf
    line.end = -math.inf
    for i in range(a, b):
        point = points[i]
        e = distance_from(line, point)
        t = abscissa_on(line, point.x, point.y)
        cosine = 1.0
        if point.ray_x != 0.0 or point.ray_y != 0.0:
            cosine = line.nx * point.ray_x + line.ny * point.ray_y
            if cosine > LEAST_COSINE:
                t = line.p * (line.nx * point.ray_y - line.ny * point.ray_x) / cosine
        v = scanner.variance * cosine * cosine + scanner.floor
        own[i] = e * e <= gate * v
        if own[i]:
            line.begin = min(line.begin, t)
            line.end = max(line.end, t)
            w = 1.0 / v
            t -= line.middle
            w_sum += w
            t_sum += w * t
            e_sum += w * e
            tt += w * t * t
            te += w * t * e
            ee += w * e * e
            count += 1
    if count == 0:
        return Weighed(0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    t_mean = t_sum / w_sum
    e_mean = e_sum / w_sum
    return Weighed(count, w_sum, t_mean, e_mean, tt - t_sum * t_mean, te - t_sum * e_mean, ee)


@kernel
def adjoin(points: Records, z: int, a: int, scanner: Record) -> bool:
    """Tell whether one wall may reach from point z to point a."""
    one = points[z]
    other = points[a]
    sine = abs(one.ray_x * other.ray_y - one.ray_y * other.ray_x)
    turn = math.atan2(sine, one.ray_x * other.ray_x + one.ray_y * other.ray_y)
    near = math.hypot(other.x - one.x, other.y - one.y) <= scanner.longest
    return near and a - z - 1 <= SKIPPED and turn <= SKIPPED_STEPS * scanner.increment + 1e-9


@kernel
def seen_through(line: Record, points: Records, a: int, b: int, scanner: Record) -> bool:
    """Tell whether a point from a to b - 1 lies behind the line, as seen from the sensor."""
    for i in range(a, b):
        cosine = line.nx * points[i].ray_x + line.ny * points[i].ray_y
        off = distance_from(line, points[i])
        gate = POINT_GATE * POINT_GATE * (scanner.variance * cosine * cosine + scanner.floor)
        if off * cosine > 0.0 and off * off > gate:
            return True
    return False


@kernel
def bridge(
    pieces: Records, sums: Records, points: Records, min_points: int, scanner: Record
) -> tuple[Records, Records]:
    """Join pieces of one line with a few points in front of it between them.

    Pieces of fewer than three points are left out. Returns the pieces, and the sums of the points that are their own.
    """
    bounds = np.empty_like(pieces)
    totals = np.empty(len(pieces), SUMS)
    scratch = np.empty(2, SUMS)
    lines = np.empty(1, FITTED)
    own = scratch[0]
    joint = scratch[1]
    count = 0
    for k in range(len(pieces)):
        a = pieces[k].first
        b = pieces[k].end
        if b - a < LEAST_POINTS:
            continue
        subtract(sums[b], sums[a], own)
        if count > 0:
            last = bounds[count - 1]
            total = totals[count - 1]
            if a - last.end <= SKIPPED and max(b - a, total.count) >= min_points:
                add(total, own, joint)
                line_of(joint, lines[0])
                zero = sums[0]
                growth = math.inf
                if adjoin(points, last.end - 1, a, scanner):
                    apart = line_cost(zero, total, scanner) + line_cost(zero, own, scanner)
                    growth = line_cost(zero, joint, scanner) - apart
                if growth < BREAK_PENALTY and not seen_through(lines[0], points, last.end, a, scanner):
                    last.end = b
                    totals[count - 1] = joint
                    continue
        bounds[count] = pieces[k]
        totals[count] = own
        count += 1
    keep_alive(scratch)
    keep_alive(lines)
    return bounds[:count].copy(), totals[:count].copy()


@kernel
def rejoin(points: Records, lines: Records, scanner: Record) -> int:
    """Make one of neighbouring lines, in place, that their points do not distinguish by the full likelihood.

    The running sums take the noise for the same all along a piece and sometimes break a wall for it. Returns how many
    lines are left.
    """
    own = np.empty(len(points), np.bool_)
    scratch = np.empty(1, FITTED)
    joint = scratch[0]
    count = 0
    for k in range(len(lines)):
        lines[count] = lines[k]
        count += 1
        if count < 2:
            continue
        one = lines[count - 2]
        other = lines[count - 1]
        sine = one.nx * other.ny - one.ny * other.nx
        cosine = one.nx * other.nx + one.ny * other.ny
        if abs(sine) > NEAR_PARALLEL or cosine < 0.0 or not adjoin(points, one.last, other.first, scanner):
            continue
        scratch[0] = one if one.weight * one.spread > other.weight * other.spread else other
        joint.first = one.first
        joint.last = other.last
        for _ in range(JOINT_FITS):
            fit_line(points, joint.first, joint.last + 1, scanner, joint, own)
        if seen_through(joint, points, one.last + 1, other.first, scanner):
            continue
        everyone = joint.count >= one.count + other.count - 1.0
        excess = joint.chi2 - one.chi2 - other.chi2
        if everyone and (excess < BREAK_PENALTY or excess < FLATNESS * FLATNESS * joint.weight):
            lines[count - 2] = joint
            count -= 1
    keep_alive(scratch)
    return count
