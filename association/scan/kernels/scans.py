"""Compiled records of a scan; see `association.scan.scan_lines` for what they mean."""

import math

import numpy as np

from compiled import kernel
from registration.kernels import keep_alive
from registration.layout import INFORMATION, LEAST_POINTS, Floats, Record, Records

from ...consensus.kernels.consensus import freedom_taken
from ...consensus.kernels.ordering import ascending
from ...layout import LINE_PARTS, SCAN_LINE, SIGHTING, Indices, Integers
from ...tables import Measured
from ...tuning import (
    CUT_COSINE,
    CUT_LATERAL,
    GAIN,
    GAIN_LENGTH,
    GAIN_PER_METRE,
    LEAST_SPREAD,
    LEAST_VARIANCE,
    LINE_COSINE,
    LINE_GAP,
    LINE_LATERAL,
    MODEL_ANGLE,
    MODEL_OFFSET,
    ROUGHNESS,
)


@kernel
def as_lines(measured: Measured) -> Records:
    """Return each segment as a line by itself, (n,) of `LINE_PARTS`."""
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

    In `order`, the longest first: each that is on no line yet begins one, and takes on those whose middle is within
    `lateral` metres of it and that are turned by no more than `least_cosine` says, as far as they follow without a gap
    of more than `LINE_GAP`. Unless they are `directed` a part may run against its line. The lines are numbered in the
    order of those that begin them.
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
        dx = first.dx
        dy = first.dy
        count = 0
        for later in range(k + 1, n):
            j = order[later]
            cosine = given[j].dx * dx + given[j].dy * dy
            if not directed:
                cosine = abs(cosine)
            if labels[j] >= 0 or cosine < least_cosine:
                continue
            x = given[j].x - first.x
            y = given[j].y - first.y
            if abs(dx * y - dy * x) > lateral:
                continue
            near[count] = j
            lows[count] = dx * x + dy * y - 0.5 * given[j].length * cosine
            highs[count] = dx * x + dy * y + 0.5 * given[j].length * cosine
            count += 1
        low = -0.5 * first.length
        high = 0.5 * first.length
        grown = count > 0
        while grown:
            grown = False
            for m in range(count):
                j = near[m]
                if labels[j] < 0 and lows[m] <= high + LINE_GAP and highs[m] >= low - LINE_GAP:
                    labels[j] = lines
                    low = min(low, lows[m])
                    high = max(high, highs[m])
                    grown = True
        lines += 1
    return labels


@kernel
def join_labelled(given: Records, order: Integers, labels: Integers, counted: bool) -> Records:
    """Return what the parts of each label show together, (k,) of `LINE_PARTS`.

    What overlaps counts its points once. Where they were not `counted`, a line has `LEAST_POINTS` at least.
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
    """Return (m,) the share of each part along a line that those before it do not cover; write `covered`."""
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
    shares = shares_of(given, members, line)
    points = 0.0
    information = 0.0
    exact = False
    for k in range(len(members)):
        i = members[k]
        shares[k] *= given[i].points
        points += shares[k]
        if given[i].sigma > 0.0:
            information += shares[k] / given[i].sigma ** 2
        else:
            exact = exact or shares[k] > 0.0
    x = 0.0
    y = 0.0
    for k in range(len(members)):
        x += shares[k] / points * given[members[k]].centroid_x
        y += shares[k] / points * given[members[k]].centroid_y
    xx = 0.0
    xy = 0.0
    yy = 0.0
    for k in range(len(members)):
        i = members[k]
        share = shares[k] / points
        dx = given[i].dx
        dy = given[i].dy
        gx = given[i].centroid_x - x
        gy = given[i].centroid_y - y
        xx += share * (gx * gx + given[i].spread * dx * dx)
        xy += share * (gx * gy + given[i].spread * dx * dy)
        yy += share * (gy * gy + given[i].spread * dy * dy)
    angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
    dx = math.cos(angle)
    dy = math.sin(angle)
    if dx * line.dx + dy * line.dy < 0.0:
        dx = -dx
        dy = -dy
    low = math.inf
    high = -math.inf
    for i in members:
        along = dx * (given[i].x - x) + dy * (given[i].y - y)
        low = min(low, along - 0.5 * given[i].length)
        high = max(high, along + 0.5 * given[i].length)
    line.dx = dx
    line.dy = dy
    line.x = x + 0.5 * (low + high) * dx
    line.y = y + 0.5 * (low + high) * dy
    line.length = high - low
    line.centroid_x = x
    line.centroid_y = y
    line.spread = dx * dx * xx + 2.0 * dx * dy * xy + dy * dy * yy
    line.points = points
    line.variance = 0.0 if exact else 1.0 / information


@kernel
def freedom_alone(line: Record, model: Record, information: Record) -> float:
    """Return the freedom that a line takes from a pose by itself, nats: no set with it takes less."""
    weight = line.weight / (1.0 + line.weight * model.wall_variance)
    lever = line.dx * line.centroid_x + line.dy * line.centroid_y
    information.xx = weight  # across the line
    information.xy = 0.0
    information.xt = weight * lever
    information.yy = 0.0
    information.yt = 0.0
    information.tt = weight * lever * lever + line.weight * line.spread
    return freedom_taken(information, model)


@kernel
def describe_lines(lines: Records, order: Integers, variances: Records, model: Records) -> Records:
    """Return the `lines` of a scan in `order`, (n,) of `SCAN_LINE`; `variances` and `model` (1,)."""
    given = variances[0]
    n = len(order)
    out = np.zeros(n, SCAN_LINE)
    alone = np.zeros(1, INFORMATION)
    later = 0.0
    for k in range(n - 1, -1, -1):
        line = lines[order[k]]
        one = out[k]
        spread = max(line.spread, LEAST_SPREAD)
        one.dx = line.dx
        one.dy = line.dy
        one.x = line.x
        one.y = line.y
        one.length = line.length
        one.angle = math.atan2(line.dy, line.dx)
        one.centroid_x = line.centroid_x
        one.centroid_y = line.centroid_y
        one.spread = line.spread
        offset = line.variance + given.map + MODEL_OFFSET**2
        angle = (line.variance + given.common) / spread + MODEL_ANGLE**2
        one.offset_variance = max(given.least_offset, offset + line.common_offset)
        one.angle_variance = max(given.least_angle, angle + line.common_angle)
        common = max(line.common_offset, line.common_angle * spread)
        one.weight = 1.0 / max(line.variance + ROUGHNESS**2 + common, given.least_angle * spread)
        one.gain = GAIN + GAIN_PER_METRE * min(line.covered, GAIN_LENGTH)
        if common > 0.0:
            # Wider gates are met by chance more often: what a match tells less for that.
            one.gain = max(0.0, one.gain - 0.5 * math.log1p(line.common_offset / offset))
            one.gain = max(0.0, one.gain - 0.5 * math.log1p(line.common_angle / angle))
        one.later_gain = later
        one.plain_variance = max(LEAST_VARIANCE, line.variance + given.map + line.common_offset)
        one.freedom = freedom_alone(one, model[0], alone[0])
        later += one.gain
    keep_alive(alone)
    return out


@kernel
def set_map_sigma(sigma: float, variances: Records, model: Records) -> None:
    """Write what follows from the deviation of the map's lines, metres, to both, (1,) each.

    A tolerance that is wider says that the map is that far off.
    """
    given = variances[0]
    given.map = sigma * sigma
    model[0].wall_variance = max(given.map + (MODEL_OFFSET**2 - ROUGHNESS**2), given.least_offset)


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


@kernel
def describe_labelled(labels: Integers, lines: Records, variances: Records, model: Records) -> tuple[Indices, Records]:
    """Order lines by what they tell; return the row of each part that is labelled, and the rows."""
    order = longest_first(lines)
    place = np.empty(len(order), np.int64)
    for k in range(len(order)):
        place[order[k]] = k
    row_of = np.empty(len(labels), np.int64)
    for i in range(len(labels)):
        row_of[i] = place[labels[i]]
    return row_of, describe_lines(lines, order, variances, model)


@kernel
def seen_at_once(rows: Records) -> Records:
    """Return what one view shows of the rows: each of them, in their order, (n,) of `SIGHTING`."""
    seen = np.zeros(len(rows), SIGHTING)
    for i in range(len(rows)):
        seen[i].row = i
        seen[i].dx = rows[i].dx
        seen[i].dy = rows[i].dy
        seen[i].x = rows[i].x
        seen[i].y = rows[i].y
        seen[i].length = rows[i].length
    return seen


@kernel
def describe_view(
    measured: Measured, counted: bool, directed: bool, variances: Records, model: Records
) -> tuple[Indices, Records, Records]:
    """Return the row of each segment of a scan of one view, the rows, and what is seen of them."""
    labels, lines = lines_of_a_view(measured, counted, directed)
    row_of, rows = describe_labelled(labels, lines, variances, model)
    return row_of, rows, seen_at_once(rows)


@kernel
def mirror_lines(rows: Records) -> tuple[Records, Records]:
    """Return the rows of the scan with left and right exchanged, and what one view shows of them.

    Then y is -y, and free space stays on the left.
    """
    out = np.copy(rows)
    for i in range(len(rows)):
        out[i].dx = -rows[i].dx
        out[i].y = -rows[i].y
        out[i].centroid_y = -rows[i].centroid_y
        out[i].angle = math.atan2(out[i].dy, out[i].dx)
    return out, seen_at_once(out)
