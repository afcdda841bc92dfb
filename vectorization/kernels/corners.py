"""Corners of neighbouring lines: where they are, and which points belong to which side."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from compiled import kernel
from registration.layout import Floats, Record, Records, X, Y

from .. import tuning
from .lines import fit_line

Indices = NDArray[np.int64]
Corner = tuple[bool, float, float]  # whether two lines meet between their nearest points, and where, m


@kernel
def corner(points: Records, one: Record, other: Record, scanner: Record) -> Corner:
    """Return where two lines meet, if they do between the last point of one and the first of the other."""
    beams = (other.first - one.last) % len(points)
    sine = one.nx * other.ny - one.ny * other.nx
    if beams > tuning.CORNER_BEAMS or abs(sine) < tuning.LEAST_CORNER:
        return False, 0.0, 0.0
    x = (one.p * other.ny - other.p * one.ny) / sine
    y = (other.p * one.nx - one.p * other.nx) / sine
    # Points of one wall within the gate of the other lie that far beyond the corner.
    slack = tuning.POINT_GATE * math.sqrt(scanner.variance) / abs(sine)
    near = True
    for side in range(2):
        line = one if side == 0 else other
        point = points[one.last if side == 0 else other.first]
        t = line.nx * point.y - line.ny * point.x
        end = line.begin if abs(t - line.begin) < abs(t - line.end) else line.end
        # About as far as to the next ray, or a point's spacing.
        if scanner.increment > 0.0:
            cosine = max(tuning.LEAST_COSINE, line.nx * point.ray_x + line.ny * point.ray_y)
            reach = tuning.CORNER_REACH * scanner.increment * math.hypot(point.x, point.y) / cosine
        else:
            reach = tuning.CORNER_REACH * (line.end - line.begin) / (line.count - 1.0)
        near &= abs(line.nx * y - line.ny * x - end) <= beams * reach + slack
    return near, x, y


@kernel
def is_before(point: Record, one: Record, other: Record, at: Corner) -> bool:
    """Tell whether a point is on the first line's side of its corner with the other: by its ray, or the nearer line."""
    if point.ray_x != 0.0 or point.ray_y != 0.0:
        return point.ray_x * at[2] - point.ray_y * at[1] >= 0.0
    off = abs(one.nx * point.x + one.ny * point.y - one.p)
    return off <= abs(other.nx * point.x + other.ny * point.y - other.p)


@kernel
def share_corners(points: Records, lines: Records, scanners: Records, closed: bool, scratch: Records) -> None:
    """Give the points about each corner to the line on their side of it, and fit both lines again.

    The last and the first line of a `closed` scan only lose points beyond their corner. `scratch` (2,) is room to work
    in.
    """
    scanner = scanners[0]
    m = len(lines)
    for k in range(m if closed and m > 1 else m - 1):
        seam = k == m - 1
        for _ in range(1 if seam else tuning.SHARING_ROUNDS):
            scratch[0] = lines[k]
            scratch[1] = lines[(k + 1) % m]
            one = scratch[0]
            other = scratch[1]
            at = corner(points, one, other, scanner)
            if not at[0]:
                break
            last = one.last
            first = other.first
            least = max(one.first + 2, last - tuning.BREAK_REACH)
            if seam:
                most = min(other.last - 2, first + tuning.BREAK_REACH)
                while first < most and is_before(points[first], one, other, at):
                    first += 1
            else:
                most = min(other.last - 4, last + tuning.BREAK_REACH - 1)
                while last <= most and is_before(points[last + 1], one, other, at):
                    last += 1
            while last > least and not is_before(points[last], one, other, at):
                last -= 1
            if not seam:
                first = last + 1
            if last == one.last and first == other.first:
                break
            good = True
            for side in range(2):
                line = scratch[side]
                low = line.first if side == 0 else first
                high = last if side == 0 else line.last
                if not seam or low != line.first or high != line.last:
                    line.first = low
                    line.last = high
                    good = good and (fit_line(points, low, high + 1, scanner, line) or seam)
            if not (good and (seam or min(one.count, other.count) >= tuning.LEAST_POINTS)):
                break
            lines[k] = one
            lines[(k + 1) % m] = other


@kernel
def cut_corners(
    points: Records,
    lines: Records,
    scanners: Records,
    closed: bool,
    origin: Floats,
    found: Floats,
    spans: Indices,
) -> int:
    """Move the ends of neighbouring lines to their corner, and write what is known of those that stay large enough.

    At a corner a line may have lost points, or an end. The lines that stay are put first; returns their number. Written
    are `found` (m, 8), in the frame in which the sensor is at `origin` (2,): end points, centroid, sigma and root mean
    square distance; and `spans` (m, 2), the first and the last point. Sigma is such that
    count / sigma^2 is the weight, and widened where the points lie worse than chance lets them.
    """
    m = len(lines)
    for k in range(m if closed and m > 1 else m - 1):
        meet, x, y = corner(points, lines[k], lines[(k + 1) % m], scanners[0])
        for side in range(2 if meet else 0):
            line = lines[(k + side) % m]
            t = line.nx * y - line.ny * x
            if abs(t - line.begin) < abs(t - line.end):
                line.begin = t
            else:
                line.end = t
    left = 0
    for k in range(m):
        line = lines[k]
        if line.count < scanners[0].least_points or line.end - line.begin < scanners[0].least_length:
            continue
        foot_x = origin[X] + line.p * line.nx
        foot_y = origin[Y] + line.p * line.ny
        found[left, 0] = foot_x - line.begin * line.ny
        found[left, 1] = foot_y + line.begin * line.nx
        found[left, 2] = foot_x - line.end * line.ny
        found[left, 3] = foot_y + line.end * line.nx
        dof = max(1.0, line.count - 2.0)
        widening = line.chi2 / dof if line.chi2 > dof + tuning.WIDENING * math.sqrt(2.0 * dof) else 1.0
        found[left, 4] = foot_x - line.middle * line.ny
        found[left, 5] = foot_y + line.middle * line.nx
        found[left, 6] = math.sqrt(line.count / line.weight * widening)
        found[left, 7] = math.sqrt(line.chi2 / line.weight)
        spans[left, 0] = line.first
        spans[left, 1] = line.last
        lines[left] = line
        left += 1
    return left
