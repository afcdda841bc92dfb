"""Compiled lines of a scan: segments that continue or repeat one another, joined, and what the search reads of them."""

import math

import numpy as np

from compiled import kernel
from registration.layout import LEAST_POINTS, Floats, Record, Records

from ...layout import LINE_PARTS, SCAN_LINE, SIGHTING, Indices
from ...tuning import GAIN, GAIN_LENGTH, GAIN_PER_METRE, LOOSE_WALLS, MODEL_ANGLE, MODEL_OFFSET, ROUGHNESS
from ..tuning import LEAST_SPREAD, LEAST_VARIANCE, LINE_GAP


@kernel
def ascending(values: Floats) -> Indices:
    """Return the places of values in their order, ties by place; one sorting for all, which is compiled once."""
    return np.argsort(values, kind="mergesort")


@kernel
def union(lows: Floats, highs: Floats, count: int, low: float, high: float) -> float:
    """Return the length between two abscissae that intervals cover, of which those that begin first come first."""
    total = 0.0
    for k in range(count):
        begin = max(lows[k], low)
        end = min(highs[k], high)
        if end > begin:
            total += end - begin
            low = end
    return total


@kernel
def insert(lows: Floats, highs: Floats, count: int, low: float, high: float) -> int:
    """Add an interval to some that are ordered by their begins; return where it stands."""
    k = count
    while k > 0 and lows[k - 1] > low:
        lows[k], highs[k] = lows[k - 1], highs[k - 1]
        k -= 1
    lows[k], highs[k] = low, high
    return k


@kernel
def join_parts(
    parts: Records, members: Indices, count: int, line: Record, lows: Floats, highs: Floats, weights: Floats
) -> None:
    """Write the line through the first `count` members to `line`, which is the first of them; see `join_lines`.

    The last three are room for as many numbers.
    """
    dx, dy = line.dx, line.dy
    line.covered = points = information = 0.0
    exact = False
    for m in range(count):
        part = parts[members[m]]
        # The union of the parts so far along the line, in the order of their begins.
        along = dx * (part.x - line.x) + dy * (part.y - line.y)
        begin, end = along - 0.5 * part.length, along + 0.5 * part.length
        insert(lows, highs, m, begin, end)
        covered = union(lows, highs, m + 1, -math.inf, math.inf)
        weights[m] = min(1.0, max(0.0, (covered - line.covered) / part.length)) * part.points
        line.covered = covered
        points += weights[m]
        if part.sigma > 0.0:
            information += weights[m] / part.sigma**2
        else:
            exact = exact or weights[m] > 0.0
    line.points, line.variance = points, 0.0 if exact else 1.0 / information
    x = y = lengths = common_offset = common_angle = 0.0
    for m in range(count):
        part = parts[members[m]]
        x += weights[m] / points * part.centroid_x
        y += weights[m] / points * part.centroid_y
        lengths += part.length
        common_offset += part.length * part.common_offset
        common_angle += part.length * part.common_angle
    line.common_offset, line.common_angle = common_offset / lengths, common_angle / lengths
    xx = xy = yy = 0.0
    for m in range(count):
        part = parts[members[m]]
        fraction, gx, gy = weights[m] / points, part.centroid_x - x, part.centroid_y - y
        xx += fraction * (gx * gx + part.spread * part.dx * part.dx)
        xy += fraction * (gx * gy + part.spread * part.dx * part.dy)
        yy += fraction * (gy * gy + part.spread * part.dy * part.dy)
    angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
    sign = 1.0 if math.cos(angle) * dx + math.sin(angle) * dy >= 0.0 else -1.0
    dx, dy = sign * math.cos(angle), sign * math.sin(angle)
    low, high = math.inf, -math.inf
    for m in range(count):
        part = parts[members[m]]
        along = dx * (part.x - x) + dy * (part.y - y)
        low, high = min(low, along - 0.5 * part.length), max(high, along + 0.5 * part.length)
    line.dx, line.dy, line.length = dx, dy, high - low
    line.centroid_x, line.centroid_y = x, y
    line.x, line.y = x + 0.5 * (low + high) * dx, y + 0.5 * (low + high) * dy
    line.spread = dx * dx * xx + 2.0 * dx * dy * xy + dy * dy * yy


@kernel
def join_lines(given: Records, joints: Floats, counted: bool, directed: bool) -> tuple[Indices, Records]:
    """Join parts of lines that continue or repeat one another, in rounds, (r, 2) lateral offsets (m) and cosines.

    In each round the longest part that is on no line yet begins one. It takes on parts whose middle is within the
    lateral offset and whose direction agrees up to the cosine. They have to follow without a gap of more than
    `LINE_GAP`. Unless they are `directed` a part may run against its line. One line is put through the points behind
    all its parts, in the direction in which they spread most. The points of overlapping parts count once. If they were
    not `counted`, a line has `LEAST_POINTS` at least. Their common errors are means by length.

    Parameters
    ----------
    given : (n,) of `LINE_PARTS`; of these `covered` and `variance` are not read

    Returns
    -------
    (n,) the line of each part
    (k,) of `LINE_PARTS`, the longest first, ties by index
    """
    labels = np.empty(len(given), np.int64)
    for i in range(len(given)):
        labels[i] = i
    parts = given
    for done in range(len(joints) + 1):
        n = len(parts)
        order = ascending(-parts["length"])
        if done == len(joints):
            break
        lateral, least_cosine = joints[done, 0], joints[done, 1]
        line_of = np.full(n, -1)
        lines = np.empty(n, LINE_PARTS)
        members = np.empty(n, np.int64)
        lows, highs, weights = np.empty(n), np.empty(n), np.empty(n)
        found = 0
        for place in range(n):
            i = order[place]
            if line_of[i] >= 0:
                continue
            first = parts[i]
            dx, dy = first.dx, first.dy
            line_of[i] = found
            # The parts near its line, and between which abscissae from its middle they lie.
            members[0] = i
            near = 1
            for later in range(place + 1, n):
                j = order[later]
                part = parts[j]
                cosine = part.dx * dx + part.dy * dy
                if not directed:
                    cosine = abs(cosine)
                x, y = part.x - first.x, part.y - first.y
                if line_of[j] < 0 and cosine >= least_cosine and abs(dx * y - dy * x) <= lateral:
                    members[near] = j
                    lows[near] = dx * x + dy * y - 0.5 * part.length * cosine
                    highs[near] = dx * x + dy * y + 0.5 * part.length * cosine
                    near += 1
            low, high = -0.5 * first.length, 0.5 * first.length
            growing = near > 1
            while growing:
                growing = False
                for m in range(1, near):
                    j = members[m]
                    if line_of[j] < 0 and lows[m] <= high + LINE_GAP and highs[m] >= low - LINE_GAP:
                        line_of[j] = found
                        low, high = min(low, lows[m]), max(high, highs[m])
                        growing = True
            count = 0
            for m in range(near):
                if line_of[members[m]] == found:
                    members[count] = members[m]
                    count += 1
            lines[found] = first
            line = lines[found]
            line.covered, line.variance = first.length, first.sigma**2 / first.points
            if count > 1:
                join_parts(parts, members, count, line, lows, highs, weights)
            if not counted and done + 1 == len(joints) and line.points < LEAST_POINTS:
                line.variance *= line.points / LEAST_POINTS
            line.sigma = math.sqrt(line.variance * line.points)
            found += 1
        if found < n or done + 1 == len(joints):
            for i in range(len(labels)):
                labels[i] = line_of[labels[i]]
            parts = lines[:found]
    place_of = np.empty(len(parts), np.int64)
    out = np.empty(len(parts), LINE_PARTS)
    for k in range(len(parts)):
        out[k] = parts[order[k]]
        place_of[order[k]] = k
    for i in range(len(labels)):
        labels[i] = place_of[labels[i]]
    return labels, out


@kernel
def describe_lines(lines: Records, variances: Records, model: Records) -> tuple[Records, Records]:
    """Return what the search reads of `lines` (n,) of `LINE_PARTS`, the longest first; `variances` and `model` (1,).

    Returns (n,) of `SCAN_LINE`, and the parts of them that one view shows, (n,) of `SIGHTING`: each of them, as it is.
    """
    given, walls = variances[0], model[0]
    n = len(lines)
    out, seen = np.zeros(n, SCAN_LINE), np.zeros(n, SIGHTING)
    for k in range(n):
        line, one, sight = lines[k], out[k], seen[k]
        spread = max(line.spread, LEAST_SPREAD)
        one.dx, one.dy, one.x, one.y, one.length = line.dx, line.dy, line.x, line.y, line.length
        sight.dx, sight.dy, sight.x, sight.y, sight.length = line.dx, line.dy, line.x, line.y, line.length
        sight.row = k
        one.angle = math.atan2(line.dy, line.dx)
        one.centroid_x, one.centroid_y, one.spread = line.centroid_x, line.centroid_y, line.spread
        offset = line.variance + given.map + MODEL_OFFSET**2
        angle = (line.variance + given.common) / spread + MODEL_ANGLE**2
        one.offset_variance = max(given.least_offset, offset + line.common_offset)
        one.angle_variance = max(given.least_angle, angle + line.common_angle)
        common = max(line.common_offset, line.common_angle * spread)
        one.weight = 1.0 / max(line.variance + ROUGHNESS**2 + common, given.least_angle * spread)
        one.gain = GAIN + GAIN_PER_METRE * min(line.covered, GAIN_LENGTH)
        if common > 0.0:
            # Matches in wider gates occur by chance more often: such a match gains less.
            one.gain = max(0.0, one.gain - 0.5 * math.log1p(line.common_offset / offset))
            one.gain = max(0.0, one.gain - 0.5 * math.log1p(line.common_angle / angle))
        # The models of the verdict were fitted to maps of unknown deviation: a declared one would let any misfit up to
        # it pass as expected. Beyond the deviations that they were fitted to it does.
        beyond = max(0.0, given.map - LOOSE_WALLS**2)
        one.plain_variance = max(LEAST_VARIANCE, line.variance + beyond + line.common_offset)
        # The freedom that the line alone takes from a pose, see `log_determinant`: no set with it takes less.
        weight = one.weight / (1.0 + one.weight * walls.wall_variance)
        lever = line.dx * (line.centroid_x - walls.sensor_x) + line.dy * (line.centroid_y - walls.sensor_y)
        xx = 1.0 + weight * walls.free_distance * walls.free_distance
        xt = weight * lever * walls.free_distance * walls.free_angle
        tt = weight * lever * lever + one.weight * line.spread
        tt = 1.0 + tt * walls.free_angle * walls.free_angle
        one.freedom = 0.5 * math.log(xx * max(1.0, tt - xt / xx * xt))
    return out, seen
