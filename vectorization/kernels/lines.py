"""Maximum likelihood lines: their fit, their extension, and whether two pieces or two lines are one."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compiled import kernel
from registration.layout import Record, Records

from .. import tuning
from .pieces import add, line_cost

Flags = NDArray[np.bool_]


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
def fit_line(points: Records, a: int, b: int, scanner: Record, line: Record) -> bool:
    """Move `line` to the maximum likelihood one of the points a to b - 1 that lie within the gate.

    Range noise acts along the ray: with the wall at distance p, minimise ``sum (r - p / (n.u))^2 / v`` by Gauss-Newton,
    whose abscissae are where the rays meet the line. Points without ray count with their distance from the line.
    Returns whether there are any two apart.
    """
    scale = 2.0
    for turn in range(tuning.FIT_STEPS):
        gate = tuning.POINT_GATE * tuning.POINT_GATE * scale
        weight = abscissa = distance = 0.0
        abscissa2 = product = chi2 = 0.0
        count = 0
        line.begin = math.inf
        line.end = -math.inf
        for i in range(a, b):
            point = points[i]
            e = line.nx * point.x + line.ny * point.y - line.p
            t = line.nx * point.y - line.ny * point.x
            cosine = 1.0
            if point.ray_x != 0.0 or point.ray_y != 0.0:
                cosine = line.nx * point.ray_x + line.ny * point.ray_y
                if cosine > tuning.LEAST_COSINE:
                    t = line.p * (line.nx * point.ray_y - line.ny * point.ray_x) / cosine
            v = scanner.variance * cosine * cosine + scanner.floor
            if e * e <= gate * v:
                line.begin = min(line.begin, t)
                line.end = max(line.end, t)
                w = 1.0 / v
                t -= line.middle
                weight += w
                abscissa += w * t
                distance += w * e
                abscissa2 += w * t * t
                product += w * t * e
                chi2 += w * e * e
                count += 1
        if count < 2:
            return False
        mean = abscissa / weight
        off = distance / weight
        # Squares and products about the means.
        abscissa2 -= abscissa * mean
        if not abscissa2 > 0.0:
            return False
        line.middle += mean
        line.spread = abscissa2 / weight
        line.weight = weight
        line.count = count
        line.chi2 = chi2
        if turn == 0:
            scale = max(1.0, chi2 / max(1, count - 2))
        slope = (product - abscissa * off) / abscissa2
        offset = line.p + off
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
        if turn > 1 and slope * slope * abscissa2 + off * off * weight < tuning.SETTLED:
            break
    return True


@kernel
def seen_through(line: Record, points: Records, a: int, b: int, scanner: Record) -> bool:
    """Tell whether a point from a to b - 1 lies behind the line, as seen from the sensor."""
    for i in range(a, b):
        cosine = line.nx * points[i].ray_x + line.ny * points[i].ray_y
        off = line.nx * points[i].x + line.ny * points[i].y - line.p
        gate = tuning.POINT_GATE * tuning.POINT_GATE * (scanner.variance * cosine * cosine + scanner.floor)
        if off * cosine > 0.0 and off * off > gate:
            return True
    return False


@kernel
def bridge(pieces: Records, sums: Records, totals: Records, points: Records, scanners: Records, line: Records) -> int:
    """Join pieces of one line, in place, with a few points in front of it between them; count the pieces that are left.

    Pieces of fewer than three points are left out. Writes the sums of the points that are each piece's own to `totals`,
    (n + 2,). `line` (1,) of `FITTED` is room to work in.
    """
    scanner = scanners[0]
    zero = sums[0]
    count = 0
    for k in range(len(pieces)):
        a = pieces[k].first
        b = pieces[k].end
        if b - a < tuning.LEAST_POINTS:
            continue
        own = totals[count]
        add(sums[b], sums[a], -1.0, own)
        if count > 0:
            last = pieces[count - 1]
            total = totals[count - 1]
            one = points[last.end - 1]
            other = points[a]
            if a - last.end <= tuning.SKIPPED and max(own.count, total.count) >= scanner.least_points:
                sine = abs(one.ray_x * other.ray_y - one.ray_y * other.ray_x)
                turn = math.atan2(sine, one.ray_x * other.ray_x + one.ray_y * other.ray_y)
                near = math.hypot(other.x - one.x, other.y - one.y) <= scanner.longest
                if near and turn <= tuning.SKIPPED_STEPS * scanner.increment + 1e-9:
                    both = totals[count + 1]
                    add(total, own, 1.0, both)
                    line_of(both, line[0])
                    apart = line_cost(zero, total, scanner) + line_cost(zero, own, scanner)
                    one_line = line_cost(zero, both, scanner) - apart < tuning.BREAK_PENALTY
                    if one_line and not seen_through(line[0], points, last.end, a, scanner):
                        last.end = b
                        totals[count - 1] = both
                        continue
        pieces[count] = pieces[k]
        count += 1
    return count


@kernel
def extend(points: Records, start: int, direction: int, taken: Flags, line: Record, scanner: Record) -> int:
    """Return the last point, from `start` on in `direction`, that still lies on the line; one misfit may intervene."""
    last = start
    misfits = 0
    i = start + direction
    while 0 <= i < len(points) and not taken[i] and misfits <= 1:
        point = points[i]
        before = points[last]
        cosine = 1.0
        if scanner.increment > 0.0:
            cosine = line.nx * point.ray_x + line.ny * point.ray_y
            sine = abs(before.ray_x * point.ray_y - before.ray_y * point.ray_x)
            turn = math.atan2(sine, before.ray_x * point.ray_x + before.ray_y * point.ray_y)
            if turn > tuning.MISSING_STEPS * scanner.increment:
                break
        if math.hypot(point.x - before.x, point.y - before.y) > scanner.longest:
            break
        e = line.nx * point.x + line.ny * point.y - line.p
        lever = line.nx * point.y - line.ny * point.x - line.middle
        known = (1.0 + lever * lever / line.spread) / line.weight
        v = scanner.variance * cosine * cosine + scanner.floor + known
        certain = known < tuning.WORST_KNOWN * (scanner.variance + scanner.floor)
        if e * e <= tuning.POINT_GATE * tuning.POINT_GATE * v and cosine > tuning.LEAST_COSINE and certain:
            last = i
            misfits = 0
        else:
            misfits += 1
        i += direction
    return last


@kernel
def fit_lines(
    points: Records, pieces: Records, totals: Records, scanners: Records, taken: Flags, lines: Records
) -> int:
    """Fit every piece of enough points and extend it over the points around that no such piece has; count the lines.

    A line takes back what strays at its ends: a last point there belongs rather to an object next to the wall. `taken`
    (n,) is room to work in: False at first.
    """
    scanner = scanners[0]
    for k in range(len(pieces)):
        if totals[k].count >= scanner.least_points:
            taken[pieces[k].first : pieces[k].end] = True
    count = 0
    for k in range(len(pieces)):
        if totals[k].count < scanner.least_points:
            continue
        line = lines[count]
        line_of(totals[k], line)
        line.middle = (line.nx * totals[k].y - line.ny * totals[k].x) / totals[k].count
        low = pieces[k].first
        high = pieces[k].end - 1
        extended = False
        trimmed = False
        again = True
        while again and fit_line(points, low, high + 1, scanner, line):
            first = low
            last = high
            if not extended:
                extended = True
                low = extend(points, first, -1, taken, line, scanner)
                high = extend(points, last, 1, taken, line, scanner)
            if not trimmed and low == first and high == last:
                trimmed = True
                for end in range(2):
                    strays = True
                    while strays and low < high:
                        point = points[low if end == 0 else high]
                        e = line.nx * point.x + line.ny * point.y - line.p
                        cosine = line.nx * point.ray_x + line.ny * point.ray_y
                        if point.ray_x == 0.0 and point.ray_y == 0.0:
                            cosine = 1.0
                        strays = e * e > tuning.END_GATE * tuning.END_GATE * (
                            scanner.variance * cosine * cosine + scanner.floor
                        )
                        low += 1 if strays and end == 0 else 0
                        high -= 1 if strays and end == 1 else 0
            again = low != first or high != last
        if not again:
            line.first = low
            line.last = high
            taken[low : high + 1] = True
            count += 1
    return count


@kernel
def rejoin(points: Records, lines: Records, scanners: Records, scratch: Records) -> int:
    """Make one of neighbouring lines, in place, that their points do not distinguish by the full likelihood.

    The running sums take the noise for the same all along a piece and sometimes break a wall for it. Returns how many
    lines are left: those that are long enough, whose angle is known, and whose points lie on them. `scratch` (1,) is
    room to work in.
    """
    scanner = scanners[0]
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
        if abs(sine) > tuning.NEAR_PARALLEL or cosine < 0.0 or other.first - one.last - 1 > tuning.SKIPPED:
            continue
        z = points[one.last]
        a = points[other.first]
        turn = math.atan2(abs(z.ray_x * a.ray_y - z.ray_y * a.ray_x), z.ray_x * a.ray_x + z.ray_y * a.ray_y)
        apart = math.hypot(a.x - z.x, a.y - z.y)
        if apart > scanner.longest or turn > tuning.SKIPPED_STEPS * scanner.increment + 1e-9:
            continue
        scratch[0] = one if one.weight * one.spread > other.weight * other.spread else other
        joint.first = one.first
        joint.last = other.last
        for _ in range(tuning.JOINT_FITS):
            fit_line(points, joint.first, joint.last + 1, scanner, joint)
        if seen_through(joint, points, one.last + 1, other.first, scanner):
            continue
        everyone = joint.count >= one.count + other.count - 1.0
        excess = joint.chi2 - one.chi2 - other.chi2
        if everyone and (excess < tuning.BREAK_PENALTY or excess < tuning.FLATNESS * tuning.FLATNESS * joint.weight):
            lines[count - 2] = joint
            count -= 1
    left = 0
    for k in range(count):
        line = lines[k]
        known = line.weight * line.spread * tuning.WORST_ANGLE * tuning.WORST_ANGLE >= 1.0
        fits = line.chi2 <= tuning.WORST_FIT * max(1.0, line.count - 2.0) and not (
            scanner.increment > 0.0 and line.p <= 0.0
        )
        large = line.count >= scanner.least_points and line.end - line.begin >= scanner.least_length
        if known and fits and large:
            lines[left] = lines[k]
            left += 1
    return left
