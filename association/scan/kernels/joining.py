"""Compiled joints of scan segments that continue or repeat one another: one line for each wall that was seen."""

import math

import numpy as np

from compiled import kernel
from registration.layout import LEAST_POINTS, Floats, Record, Records

from ...layout import LINE_PARTS, Indices, Integers
from ...tables import Measured
from ..tuning import CUT_COSINE, CUT_LATERAL, LINE_COSINE, LINE_GAP, LINE_LATERAL
from .ordering import ascending


@kernel
def as_lines(measured: Measured) -> Records:
    """Return each segment as a line of its own, (n,) of `LINE_PARTS`."""
    directions = measured.directions
    midpoints = measured.midpoints
    lengths = measured.lengths
    centroids = measured.centroids
    spreads = measured.spreads
    sigma = measured.sigma
    points = measured.points
    lines = np.zeros(len(lengths), LINE_PARTS)
    for i in range(len(lengths)):
        line = lines[i]
        line.dx = directions[i].x
        line.dy = directions[i].y
        line.x = midpoints[i].x
        line.y = midpoints[i].y
        line.length = lengths[i]
        line.covered = lengths[i]
        line.centroid_x = centroids[i].x
        line.centroid_y = centroids[i].y
        line.spread = spreads[i]
        line.points = points[i]
        line.sigma = sigma[i]
        line.variance = sigma[i] ** 2 / points[i]
    return lines


@kernel
def longest_first(lines: Records) -> Integers:
    """Order lines by length, ties by index, (n,)."""
    lengths = np.empty(len(lines), np.float64)
    for i in range(len(lines)):
        lengths[i] = -lines[i].length
    return ascending(lengths)


@kernel
def collinear_lines(given: Records, order: Integers, lateral: float, least_cosine: float, directed: bool) -> Indices:
    """Label parts of lines that continue or repeat one another, (n,): the number of the line each is part of.

    In `order`, the longest first: each part that is on no line yet begins one. It takes on parts whose middle is within
    `lateral` metres of it and whose direction agrees up to `least_cosine`. They have to follow without a gap of more
    than `LINE_GAP`. Unless they are `directed` a part may run against its line. The lines are numbered in the order of
    those that begin them.
    """
    n = len(order)
    labels = np.full(n, -1)
    near = np.empty(n, np.int64)
    lows = np.empty(n, np.float64)
    highs = np.empty(n, np.float64)
    lines = 0
    for k in range(n):
        i = order[k]
        if labels[i] >= 0:
            continue
        labels[i] = lines
        first = given[i]
        count = 0
        for later in range(k + 1, n):
            j = order[later]
            if labels[j] < 0 and lies_along(first, given[j], lateral, least_cosine, directed):
                lows[count], highs[count] = extent_on(first, given[j], directed)
                near[count] = j
                count += 1
        take_on(near[:count], lows, highs, first.length, lines, labels)
        lines += 1
    return labels


@kernel
def cosine_to(line: Record, part: Record, directed: bool) -> float:
    """Return the cosine of the angle between two lines, at least 0 unless they are directed."""
    cosine = part.dx * line.dx + part.dy * line.dy
    return cosine if directed else abs(cosine)


@kernel
def lies_along(line: Record, part: Record, lateral: float, least_cosine: float, directed: bool) -> bool:
    """Return whether a part of a line has its middle within `lateral` metres of another, and about its direction."""
    if cosine_to(line, part, directed) < least_cosine:
        return False
    return abs(line.dx * (part.y - line.y) - line.dy * (part.x - line.x)) <= lateral


@kernel
def extent_on(line: Record, part: Record, directed: bool) -> tuple[float, float]:
    """Return between which abscissae on a line, from its midpoint, a part lies, metres."""
    cosine = cosine_to(line, part, directed)
    x = part.x - line.x
    y = part.y - line.y
    return (
        line.dx * x + line.dy * y - 0.5 * part.length * cosine,
        line.dx * x + line.dy * y + 0.5 * part.length * cosine,
    )


@kernel
def take_on(near: Integers, lows: Floats, highs: Floats, length: float, label: int, labels: Indices) -> None:
    """Label the parts near a line of some length that continue it without a gap of more than `LINE_GAP`.

    `near` (k,): the parts; `lows` and `highs` (k,) or more: between which abscissae from the line's midpoint each lies.
    """
    low = -0.5 * length
    high = 0.5 * length
    grown = len(near) > 0
    while grown:
        grown = False
        for m in range(len(near)):
            j = near[m]
            if labels[j] < 0 and lows[m] <= high + LINE_GAP and highs[m] >= low - LINE_GAP:
                labels[j] = label
                low = min(low, lows[m])
                high = max(high, highs[m])
                grown = True


@kernel
def join_labelled(given: Records, order: Integers, labels: Integers, counted: bool) -> Records:
    """Return the line that the parts of each label show together, (k,) of `LINE_PARTS`.

    The points of overlapping parts count once. If they were not `counted`, a line has `LEAST_POINTS` at least.
    """
    n = len(order)
    count = 0
    for i in range(n):
        count = max(count, labels[i] + 1)
    lines = np.empty(count, LINE_PARTS)
    members = np.empty(n, np.int64)
    starts = np.zeros(count + 1, np.int64)
    for k in range(n):
        starts[labels[order[k]] + 1] += 1
    for k in range(count):
        starts[k + 1] += starts[k]
    filled = np.copy(starts)
    for k in range(n):
        i = order[k]
        members[filled[labels[i]]] = i
        filled[labels[i]] += 1
    for k in range(count):
        lines[k] = given[members[starts[k]]]
        line = lines[k]
        line.covered = line.length
        line.common_offset = 0.0
        line.common_angle = 0.0
        if starts[k + 1] - starts[k] > 1:
            join(given, members[starts[k] : starts[k + 1]], line)
        if not counted and line.points < LEAST_POINTS:
            line.variance *= line.points / LEAST_POINTS
        line.sigma = math.sqrt(line.variance * line.points)
    return lines


@kernel
def union_length(lows: Floats, highs: Floats, count: int) -> float:
    """Return the length of the union of the first `count` intervals."""
    if count == 1:
        return highs[0] - lows[0]
    total = 0.0
    reach = -math.inf
    for k in ascending(lows[:count]):
        start = max(lows[k], reach)
        if highs[k] > start:
            total += highs[k] - start
            reach = highs[k]
    return total


@kernel
def shares_of(given: Records, members: Integers, line: Record) -> Floats:
    """Return (m,) the fraction of each part along a line that those before it do not cover; write `covered`."""
    lows = np.empty(len(members), np.float64)
    highs = np.empty(len(members), np.float64)
    shares = np.empty(len(members), np.float64)
    line.covered = 0.0
    for k in range(len(members)):
        i = members[k]
        along = line.dx * (given[i].x - line.x) + line.dy * (given[i].y - line.y)
        lows[k] = along - 0.5 * given[i].length
        highs[k] = along + 0.5 * given[i].length
        before = line.covered
        line.covered = union_length(lows, highs, k + 1)
        shares[k] = min(1.0, max(0.0, (line.covered - before) / given[i].length))
    return shares


@kernel
def join(given: Records, members: Integers, line: Record) -> None:
    """Put one line through the points behind several parts, the longest first; `line` comes as the first of them.

    Its direction is the greatest one of the points' second moment.
    """
    weights = shares_of(given, members, line)
    line.variance = weigh_by_points(given, members, weights, line)
    x = 0.0
    y = 0.0
    for k in range(len(members)):
        x += weights[k] / line.points * given[members[k]].centroid_x
        y += weights[k] / line.points * given[members[k]].centroid_y
    line.centroid_x = x
    line.centroid_y = y
    turn_to_points(given, members, weights, line)
    dx = line.dx
    dy = line.dy
    low = math.inf
    high = -math.inf
    for i in members:
        along = dx * (given[i].x - x) + dy * (given[i].y - y)
        low = min(low, along - 0.5 * given[i].length)
        high = max(high, along + 0.5 * given[i].length)
    line.x = x + 0.5 * (low + high) * dx
    line.y = y + 0.5 * (low + high) * dy
    line.length = high - low


@kernel
def weigh_by_points(given: Records, members: Integers, fractions: Floats, line: Record) -> float:
    """Turn fractions of parts (m,) into their numbers of points, write the sum, and return the variance of an offset.

    That is 0 where the points of any part are exact.
    """
    points = 0.0
    information = 0.0
    exact = False
    for k in range(len(members)):
        one = given[members[k]]
        fractions[k] *= one.points
        points += fractions[k]
        if one.sigma > 0.0:
            information += fractions[k] / one.sigma**2
        else:
            exact = exact or fractions[k] > 0.0
    line.points = points
    return 0.0 if exact else 1.0 / information


@kernel
def turn_to_points(given: Records, members: Integers, weights: Floats, line: Record) -> None:
    """Write the direction of a line in which the points of its parts spread most, and how far, from their mean."""
    xx = 0.0
    xy = 0.0
    yy = 0.0
    for k in range(len(members)):
        one = given[members[k]]
        fraction = weights[k] / line.points
        gx = one.centroid_x - line.centroid_x
        gy = one.centroid_y - line.centroid_y
        xx += fraction * (gx * gx + one.spread * one.dx * one.dx)
        xy += fraction * (gx * gy + one.spread * one.dx * one.dy)
        yy += fraction * (gy * gy + one.spread * one.dy * one.dy)
    angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
    dx = math.cos(angle)
    dy = math.sin(angle)
    if dx * line.dx + dy * line.dy < 0.0:
        dx = -dx
        dy = -dy
    line.dx = dx
    line.dy = dy
    line.spread = dx * dx * xx + 2.0 * dx * dy * xy + dy * dy * yy


@kernel
def join_lines(
    given: Records, lateral: float, least_cosine: float, counted: bool, directed: bool
) -> tuple[Indices, Records]:
    """Join what continues or repeats one another; return (n,) the line of each part, and the lines."""
    order = longest_first(given)
    labels = collinear_lines(given, order, lateral, least_cosine, directed)
    return labels, join_labelled(given, order, labels, counted)


@kernel
def lines_of_a_view(measured: Measured, counted: bool, directed: bool) -> tuple[Indices, Records]:
    """Join what one view shows of a line: first what was cut, then what lies about on it.

    Returns (n,) the line of each segment, and the lines, (k,) of `LINE_PARTS`.
    """
    given = as_lines(measured)
    cut, lines = join_lines(given, CUT_LATERAL, CUT_COSINE, True, directed)
    if len(lines) == len(given):
        return join_lines(given, LINE_LATERAL, LINE_COSINE, counted, directed)
    apart, lines = join_lines(lines, LINE_LATERAL, LINE_COSINE, counted, directed)
    for i in range(len(cut)):
        cut[i] = apart[cut[i]]
    return cut, lines
