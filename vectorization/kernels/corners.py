"""Corners of neighbouring lines: where they are, and which points belong to which side."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from compiled import kernel
from registration.kernels import keep_alive
from registration.layout import Record, Records

from ..layout import FITTED
from ..tuning import (
    BREAK_REACH,
    CORNER_BEAMS,
    CORNER_REACH,
    LEAST_CORNER,
    LEAST_COSINE,
    LEAST_POINTS,
    POINT_GATE,
    SHARING_ROUNDS,
)
from .lines import abscissa_on, distance_from, fit_line


class Corner(NamedTuple):
    """The intersection of two lines, if it lies between their nearest points."""

    found: bool
    x: float  # m
    y: float  # m


@kernel
def cut_corners(points: Records, lines: Records, scanner: Record, closed: bool) -> None:
    """Move the ends of neighbouring lines to their intersection where it lies between their nearest points' rays.

    The points next to it go to the line on their side of the corner, and both are fitted again.
    """
    m = len(lines)
    for k in range(m - 1):
        for _ in range(SHARING_ROUNDS):
            at = corner(points, lines[k], lines[k + 1], scanner)
            if not at.found or not share(points, lines, k, at, scanner):
                break
    if closed and m > 1:
        at = corner(points, lines[m - 1], lines[0], scanner)
        if at.found:
            leave_seam(points, lines[m - 1], lines[0], at, scanner)
    for k in range(m if closed and m > 1 else m - 1):
        one = lines[k]
        other = lines[(k + 1) % m]
        at = corner(points, one, other, scanner)
        if at.found:
            move_nearer_end(one, abscissa_on(one, at.x, at.y))
            move_nearer_end(other, abscissa_on(other, at.x, at.y))


@kernel
def corner(points: Records, one: Record, other: Record, scanner: Record) -> Corner:
    """Return where two lines meet, if they do between the last point of one and the first of the other."""
    beams = (other.first - one.last) % len(points)
    sine = one.nx * other.ny - one.ny * other.nx
    if beams > CORNER_BEAMS or abs(sine) < LEAST_CORNER:
        return Corner(False, 0.0, 0.0)
    x = (one.p * other.ny - other.p * one.ny) / sine
    y = (other.p * one.nx - one.p * other.nx) / sine
    z = points[one.last]
    a = points[other.first]
    here = abs(abscissa_on(one, x, y) - nearer_end(one, abscissa_on(one, z.x, z.y)))
    there = abs(abscissa_on(other, x, y) - nearer_end(other, abscissa_on(other, a.x, a.y)))
    # Points of one wall within the gate of the other lie that far beyond the corner.
    slack = POINT_GATE * math.sqrt(scanner.variance) / abs(sine)
    near = here <= beams * corner_reach(one, z, scanner.increment) + slack
    near = near and there <= beams * corner_reach(other, a, scanner.increment) + slack
    return Corner(near, x, y)


@kernel
def share(points: Records, lines: Records, k: int, at: Corner, scanner: Record) -> bool:
    """Give the points about the corner of lines k and k + 1 to their own side's line; return whether any changed."""
    one = lines[k]
    other = lines[k + 1]
    a = one.first
    b = other.last
    last = one.last
    while last + 1 < b - 2 and last < one.last + BREAK_REACH and is_before(points[last + 1], one, other, at):
        last += 1
    while last > a + 2 and last > one.last - BREAK_REACH and not is_before(points[last], one, other, at):
        last -= 1
    if last == one.last and last + 1 == other.first:
        return False
    own = np.empty(len(points), np.bool_)
    fitted = np.empty(2, FITTED)
    fitted[0] = one
    fitted[1] = other
    good = fit_line(points, a, last + 1, scanner, fitted[0], own)
    good = good and fit_line(points, last + 1, b + 1, scanner, fitted[1], own)
    good = good and fitted[0].count >= LEAST_POINTS and fitted[1].count >= LEAST_POINTS
    if good:
        fitted[0].last = last
        fitted[1].first = last + 1
        lines[k] = fitted[0]
        lines[k + 1] = fitted[1]
    keep_alive(fitted)
    return good


@kernel
def leave_seam(points: Records, one: Record, other: Record, at: Corner, scanner: Record) -> None:
    """Take from the last and the first line of a closed scan the points beyond their corner, and fit what is left."""
    own = np.empty(len(points), np.bool_)
    a = other.first
    b = one.last
    while a < other.last - 2 and a < other.first + BREAK_REACH and is_before(points[a], one, other, at):
        a += 1
    while b > one.first + 2 and b > one.last - BREAK_REACH and not is_before(points[b], one, other, at):
        b -= 1
    if a > other.first:
        other.first = a
        fit_line(points, a, other.last + 1, scanner, other, own)
    if b < one.last:
        one.last = b
        fit_line(points, one.first, b + 1, scanner, one, own)


@kernel
def is_before(point: Record, one: Record, other: Record, at: Corner) -> bool:
    """Tell whether a point is on the first line's side of its corner with the other: by its ray, or the nearer line."""
    if point.ray_x != 0.0 or point.ray_y != 0.0:
        return point.ray_x * at.y - point.ray_y * at.x >= 0.0
    return abs(distance_from(one, point)) <= abs(distance_from(other, point))


@kernel
def nearer_end(line: Record, t: float) -> float:
    """Return the end of the line that is nearer to the abscissa t."""
    return line.begin if abs(t - line.begin) < abs(t - line.end) else line.end


@kernel
def move_nearer_end(line: Record, t: float) -> None:
    """Move the nearer of the line's ends to the abscissa t."""
    if abs(t - line.begin) < abs(t - line.end):
        line.begin = t
    else:
        line.end = t


@kernel
def corner_reach(line: Record, point: Record, increment: float) -> float:
    """Return how far the end at a point may be moved: about as far as to the next ray, or a point's spacing."""
    if increment <= 0.0:
        return CORNER_REACH * (line.end - line.begin) / (line.count - 1.0)
    cosine = max(LEAST_COSINE, line.nx * point.ray_x + line.ny * point.ray_y)
    return CORNER_REACH * increment * math.hypot(point.x, point.y) / cosine
