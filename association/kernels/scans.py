"""Compiled records of a scan; see `association.scan_lines` for what they mean."""

import math

import numpy as np

from registration.compiling import inlined, kernel
from registration.kernels import keep_alive
from registration.layout import INFORMATION, LEAST_POINTS, Floats, Record, Records

from ..layout import SCAN_LINE, Integers
from ..tables import Measured
from ..tuning import (
    GAIN,
    GAIN_LENGTH,
    GAIN_PER_METRE,
    LEAST_SPREAD,
    LEAST_VARIANCE,
    LINE_GAP,
    MODEL_ANGLE,
    MODEL_OFFSET,
    ROUGHNESS,
)
from .acceptance import union_length
from .consensus import freedom_taken


@kernel
def collinear_segments(measured: Measured, order: Integers, lateral: float, least_cosine: float) -> Integers:
    """Label segments of a scan that continue or repeat one another, (n,): the number of the line each is part of.

    In `order`, the longest first: each that is on no line yet begins one, and takes on those whose middle is within
    `lateral` metres of it and that are turned by no more than `least_cosine` says, as far as they follow without a gap
    of more than `LINE_GAP`. The lines are numbered in the order of those that begin them.
    """
    directions = measured.directions
    midpoints = measured.midpoints
    lengths = measured.lengths
    n = len(order)
    labels = np.full(n, -1)
    near = np.empty(n, dtype=np.int64)
    lows = np.empty(n)
    highs = np.empty(n)
    lines = 0
    for k in range(n):
        i = order[k]
        if labels[i] >= 0:
            continue
        labels[i] = lines
        dx = directions[i].x
        dy = directions[i].y
        count = 0
        for later in range(k + 1, n):
            j = order[later]
            cosine = directions[j].x * dx + directions[j].y * dy
            if labels[j] >= 0 or cosine < least_cosine:
                continue
            x = midpoints[j].x - midpoints[i].x
            y = midpoints[j].y - midpoints[i].y
            if abs(dx * y - dy * x) > lateral:
                continue
            near[count] = j
            lows[count] = dx * x + dy * y - 0.5 * lengths[j] * cosine
            highs[count] = dx * x + dy * y + 0.5 * lengths[j] * cosine
            count += 1
        low = -0.5 * lengths[i]
        high = 0.5 * lengths[i]
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
def join_segments(measured: Measured, order: Integers, labels: Integers, counted: bool, lines: Records) -> None:
    """Write what the segments of each label show together to `lines` (k,) of `LINE_PARTS`.

    What overlaps counts its points once. Where they were not `counted`, a line has `LEAST_POINTS` at least.
    """
    directions = measured.directions
    midpoints = measured.midpoints
    lengths = measured.lengths
    centroids = measured.centroids
    n = len(order)
    members = np.empty(n, dtype=np.int64)
    starts = np.zeros(len(lines) + 1, dtype=np.int64)
    for k in range(n):
        starts[labels[order[k]] + 1] += 1
    for k in range(len(lines)):
        starts[k + 1] += starts[k]
    filled = np.copy(starts)
    for k in range(n):
        i = order[k]
        members[filled[labels[i]]] = i
        filled[labels[i]] += 1
    for k in range(len(lines)):
        line = lines[k]
        first = members[starts[k]]
        line.dx = directions[first].x
        line.dy = directions[first].y
        line.x = midpoints[first].x
        line.y = midpoints[first].y
        line.length = lengths[first]
        line.covered = lengths[first]
        line.centroid_x = centroids[first].x
        line.centroid_y = centroids[first].y
        line.spread = measured.spreads[first]
        line.points = measured.points[first]
        line.variance = measured.sigma[first] ** 2 / line.points
        line.common_offset = 0.0
        line.common_angle = 0.0
        if starts[k + 1] - starts[k] > 1:
            join(measured, members[starts[k] : starts[k + 1]], line)
        if not counted and line.points < LEAST_POINTS:
            line.variance *= line.points / LEAST_POINTS


@kernel
def shares_of(measured: Measured, members: Integers, line: Record) -> Floats:
    """Return (m,) the share of each segment along a line that those before it do not cover; write `covered`."""
    midpoints = measured.midpoints
    lengths = measured.lengths
    lows = np.empty(len(members))
    highs = np.empty(len(members))
    shares = np.empty(len(members))
    line.covered = 0.0
    for k in range(len(members)):
        i = members[k]
        along = line.dx * (midpoints[i].x - line.x) + line.dy * (midpoints[i].y - line.y)
        lows[k] = along - 0.5 * lengths[i]
        highs[k] = along + 0.5 * lengths[i]
        before = line.covered
        line.covered = union_length(lows, highs, k + 1)
        shares[k] = min(1.0, max(0.0, (line.covered - before) / lengths[i]))
    return shares


@kernel
def join(measured: Measured, members: Integers, line: Record) -> None:
    """Put one line through the points behind several segments, the longest first; `line` comes as the first of them.

    Its direction is the greatest one of the points' second moment.
    """
    directions = measured.directions
    midpoints = measured.midpoints
    lengths = measured.lengths
    centroids = measured.centroids
    shares = shares_of(measured, members, line)
    points = 0.0
    information = 0.0
    exact = False
    for k in range(len(members)):
        i = members[k]
        shares[k] *= measured.points[i]
        points += shares[k]
        if measured.sigma[i] > 0.0:
            information += shares[k] / measured.sigma[i] ** 2
        else:
            exact = exact or shares[k] > 0.0
    x = 0.0
    y = 0.0
    for k in range(len(members)):
        x += shares[k] / points * centroids[members[k]].x
        y += shares[k] / points * centroids[members[k]].y
    xx = 0.0
    xy = 0.0
    yy = 0.0
    for k in range(len(members)):
        i = members[k]
        share = shares[k] / points
        dx = directions[i].x
        dy = directions[i].y
        gx = centroids[i].x - x
        gy = centroids[i].y - y
        xx += share * (gx * gx + measured.spreads[i] * dx * dx)
        xy += share * (gx * gy + measured.spreads[i] * dx * dy)
        yy += share * (gy * gy + measured.spreads[i] * dy * dy)
    angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
    dx = math.cos(angle)
    dy = math.sin(angle)
    if dx * line.dx + dy * line.dy < 0.0:
        dx = -dx
        dy = -dy
    low = math.inf
    high = -math.inf
    for i in members:
        along = dx * (midpoints[i].x - x) + dy * (midpoints[i].y - y)
        low = min(low, along - 0.5 * lengths[i])
        high = max(high, along + 0.5 * lengths[i])
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


@inlined
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
    out = np.zeros(n, dtype=SCAN_LINE)
    alone = np.zeros(1, dtype=INFORMATION)
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
