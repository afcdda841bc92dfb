"""Compiled matching of a scan to the walls at a pose, and growing a consensus set there.

Nothing here validates. The state is a handful of flat arrays, passed as such because Numba counts references for every
array that it takes out of a tuple; their columns are named below. Poses are ``[theta, t_x, t_y]``, index frame from
scan frame.
"""

import math

import numpy as np

from registration import kernels
from registration.compiling import inlined, kernel
from registration.layout import JOINT_SUMS

from ._joint_kernels import SCAN_SEGMENT, WALL, joint_information, joint_solve

# Columns of `walls` (m, 8), one cache line a wall: 0, 1 unit direction; 2 offset along the left normal; 3, 4 abscissae
# of begin and end along the direction; 5 angle; 6, 7 the walls before and after it on its run (collinear, across a
# doorway) or -1.
# Columns of `scan` (n, 16), the most telling segments first: 0, 1 unit direction; 2, 3 midpoint; 4 length; 5 angle;
# 6, 7 centroid; 8 spread; 9, 10 variance of offset and angle; 11 weight; 12 gain; 13 sum of the gains of later rows;
# 14 variance of the offset without the model's slack.
SCAN_COLUMNS = 16
# Columns of `matches` (n, 5): 0 wall or -1; 1 offset; 2 sine of the angle; 3 overlap; 4 worth in nats.
# Places of `shape`, the geometry of the grid: x0, y0, cell size, columns, rows. Places of `gates`: how many standard
# deviations, least and greatest gate on the offset (m), least and greatest gate on the angle (rad), least overlap.

REACH = 0.4  # m; the grid lists a wall in the cells this near to it, so gates end here
MAX_ANGLE_GATE = 0.35  # rad
BRIDGING = 3.0  # m; only a longer segment may bridge a gap between walls: a short one may well be clutter there
MIN_PIVOT = 1e-12
SECTOR_BITS = 4
SECTORS = 1 << SECTOR_BITS  # of directions, in the lists by direction; 0 degrees is the middle of one
MAX_STEP = 1.0  # m; a consensus set that moves its pose farther than that, or
MAX_TURN = 0.2  # rad, is not the one that the pose was proposed for
SPRING = 1e-2  # 1/m^2; holds a pose along directions that no pair fixes, with 10 m of standard deviation


@inlined
def wrap(angle):
    """Return the angle in [-pi, pi]."""
    return angle - 2.0 * math.pi * math.floor((angle + math.pi) / (2.0 * math.pi))


@kernel
def match_scan(scan, pose, covariance, walls, starts, items, shape, gates, threshold, matches):
    """Find for every scan segment the wall that it lies on best, the most telling segments first.

    Gated by the innovation: ``offset^2`` against ``sigma^2 + g' C g`` with the pose's covariance C. Best is least in
    offset over gate plus what the overlap lacks. Writes wall or -1, offset, sine of the angle and overlap to `matches`
    and returns the sum of the gains, weighted by overlap; -1 as soon as `threshold` is out of reach.

    One loop without calls: handing arrays on costs more than the work, Numba counts references to each.
    """
    c = math.cos(pose[0])
    s = math.sin(pose[0])
    tx = pose[1]
    ty = pose[2]
    per_cell = 1.0 / shape[2]
    columns = int(shape[3])
    total = 0.0
    for i in range(len(scan)):
        gx = c * scan[i, 2] - s * scan[i, 3]
        gy = s * scan[i, 2] + c * scan[i, 3]
        dx = c * scan[i, 0] - s * scan[i, 1]
        dy = s * scan[i, 0] + c * scan[i, 1]
        # g = (n, n . J R m) with the normal n across the segment.
        lever = dx * gx + dy * gy
        var = (
            dy * dy * covariance[0, 0]
            - 2.0 * dx * dy * covariance[0, 1]
            + dx * dx * covariance[1, 1]
            + 2.0 * lever * (dx * covariance[1, 2] - dy * covariance[0, 2])
            + lever * lever * covariance[2, 2]
        )
        offset_gate = min(gates[2], max(gates[1], gates[0] * math.sqrt(scan[i, 9] + max(var, 0.0))))
        angle_gate = min(gates[4], max(gates[3], gates[0] * math.sqrt(scan[i, 10] + covariance[2, 2])))
        cos_gate = 1.0 - 0.5 * angle_gate * angle_gate
        x = gx + tx
        y = gy + ty
        fx = (x - shape[0]) * per_cell
        fy = (y - shape[1]) * per_cell
        length = scan[i, 4]
        half = 0.5 * length
        best_cost = 1e300
        matches[i, 0] = -1.0
        matches[i, 3] = 0.0
        if fx >= 0.0 and fy >= 0.0 and fx < shape[3] and fy < shape[4]:
            here = int(fy) * columns + int(fx)
            for k in range(starts[here], starts[here + 1]):
                w = items[k]
                wx = walls[w, 0]
                wy = walls[w, 1]
                offset = wx * y - wy * x - walls[w, 2]
                if abs(offset) > offset_gate or wx * dx + wy * dy < cos_gate:
                    continue
                along = wx * x + wy * y
                low = max(walls[w, 3] - along, -half)
                high = min(walls[w, 4] - along, half)
                covered = high - low
                # What bridges a doorway lies on the walls on both sides of it; the gap between speaks against that.
                bridging = length > BRIDGING and covered > 0.0
                v = int(walls[w, 6]) if low > -half and bridging else -1
                while v >= 0:
                    along = walls[v, 0] * x + walls[v, 1] * y
                    edge = walls[v, 4] - along
                    if edge <= -half:
                        break
                    covered -= low - edge
                    low = max(walls[v, 3] - along, -half)
                    covered += edge - low
                    v = int(walls[v, 6]) if low > -half else -1
                v = int(walls[w, 7]) if high < half and bridging else -1
                while v >= 0:
                    along = walls[v, 0] * x + walls[v, 1] * y
                    edge = walls[v, 3] - along
                    if edge >= half:
                        break
                    covered -= edge - high
                    high = min(walls[v, 4] - along, half)
                    covered += high - edge
                    v = int(walls[v, 7]) if high < half else -1
                overlap = min(1.0, covered / length)
                cost = abs(offset) / offset_gate + 1.0 - overlap
                if overlap >= gates[5] and cost < best_cost:
                    best_cost = cost
                    matches[i, 0] = w
                    matches[i, 1] = offset
                    matches[i, 2] = dx * wy - dy * wx
                    matches[i, 3] = overlap
        total += scan[i, 12] * matches[i, 3]
        if total + scan[i, 13] < threshold:
            return -1.0
    return total


@kernel
def angle_spreads(scan, theta_var, gates, spreads):
    """Write the angle gate of every scan segment at a pose with that variance, in sectors.

    A hundredth wider than `match_scan` has it, which tests a cosine to the second order.
    """
    for i in range(len(scan)):
        gate = 1.01 * min(gates[4], max(gates[3], gates[0] * math.sqrt(scan[i, 10] + theta_var)))
        spreads[i] = gate * (SECTORS / (2.0 * math.pi))


@kernel
def may_score(scan, pose, spreads, raster_shape, bits, threshold):
    """Tell whether the scan may score `threshold` at a pose: no segment counts where no wall of its direction is near.

    Never wrong when it says no, as long as half of a segment at least has to lie on walls, so that its midpoint does or
    is between two; and a tenth of the price of `match_scan`. `spreads` as of `angle_spreads`.
    """
    c = math.cos(pose[0])
    s = math.sin(pose[0])
    per_cell = 1.0 / raster_shape[2]
    left = (pose[1] - raster_shape[0]) * per_cell
    bottom = (pose[2] - raster_shape[1]) * per_cell
    columns = int(raster_shape[3])
    turned = (pose[0] + math.pi) * (SECTORS / (2.0 * math.pi)) + 0.5
    c *= per_cell
    s *= per_cell
    total = 0.0
    for i in range(len(scan)):
        fx = c * scan[i, 2] - s * scan[i, 3] + left
        fy = s * scan[i, 2] + c * scan[i, 3] + bottom
        if fx >= 0.0 and fy >= 0.0 and fx < raster_shape[3] and fy < raster_shape[4]:
            here = bits[int(fy) * columns + int(fx)]
            if here != 0:
                middle = turned + scan[i, 5] * (SECTORS / (2.0 * math.pi))
                for raw in range(math.floor(middle - spreads[i]), math.floor(middle + spreads[i]) + 1):
                    if (here >> (raw & (SECTORS - 1))) & 1:
                        total += scan[i, 12]
                        break
        if total + scan[i, 13] < threshold:
            return False
    return True


@kernel
def turning(theta_var, gx, gy, covariance):
    """Write the covariance of a pose held at a point, and turning about it with `theta_var`.

    ``(gx, gy)`` is that point in the scan frame, rotated: the lever from the sensor to it.
    """
    covariance[0, 0] = theta_var * gy * gy
    covariance[0, 1] = -theta_var * gx * gy
    covariance[1, 0] = covariance[0, 1]
    covariance[1, 1] = theta_var * gx * gx
    covariance[0, 2] = theta_var * gy
    covariance[2, 0] = covariance[0, 2]
    covariance[1, 2] = -theta_var * gx
    covariance[2, 1] = covariance[1, 2]
    covariance[2, 2] = theta_var


@kernel
def invert3(f, out):
    """Write the inverse of a symmetric positive 3 x 3 matrix to `out`; return False where it is singular."""
    a = f[1, 1] * f[2, 2] - f[1, 2] * f[1, 2]
    b = f[0, 2] * f[1, 2] - f[0, 1] * f[2, 2]
    d = f[0, 1] * f[1, 2] - f[0, 2] * f[1, 1]
    det = f[0, 0] * a + f[0, 1] * b + f[0, 2] * d
    if not det > MIN_PIVOT * f[0, 0] * f[1, 1] * f[2, 2]:
        return False
    out[0, 0] = a / det
    out[0, 1] = b / det
    out[0, 2] = d / det
    out[1, 1] = (f[0, 0] * f[2, 2] - f[0, 2] * f[0, 2]) / det
    out[1, 2] = (f[0, 1] * f[0, 2] - f[0, 0] * f[1, 2]) / det
    out[2, 2] = (f[0, 0] * f[1, 1] - f[0, 1] * f[0, 1]) / det
    out[1, 0] = out[0, 1]
    out[2, 0] = out[0, 2]
    out[2, 1] = out[1, 2]
    return True


@kernel
def pair(scan, i, walls, w, sign, sums):
    """Add scan segment `i` on wall `w` to the sums (`sign` 1) or remove it (-1)."""
    line = walls.view(WALL)[w, 0]
    seen = scan.view(SCAN_SEGMENT)[i, 0]
    kernels.joint_add(sums.view(JOINT_SUMS)[0], line, seen, scan[i, 11], sign)


@kernel
def value_matches(scan, matches):
    """Give each match its worth, the gain less half its chi-square, at least 0 (clutter); return their sum, nats."""
    total = 0.0
    for i in range(len(scan)):
        matches[i, 4] = 0.0
        if matches[i, 0] >= 0.0:
            offset = matches[i, 1]
            angle = math.asin(max(-1.0, min(1.0, matches[i, 2])))
            chi2 = offset * offset / scan[i, 9] + angle * angle / scan[i, 10]
            value = scan[i, 12] * matches[i, 3] - 0.5 * chi2
            if value > 0.0:
                matches[i, 4] = value
                total += value
            else:
                matches[i, 0] = -1.0
    return total


@inlined
def hold(sums, x, y, sign):
    """Add or remove the weak spring that holds a translation where it is."""
    sums[9] += sign * SPRING
    sums[12] += sign * SPRING
    sums[11] -= sign * SPRING * x
    sums[13] -= sign * SPRING * y
    sums[14] += sign * SPRING * (x * x + y * y)


@kernel
def refine(scan, pose, covariance, walls, starts, items, shape, gates, matches, sums, information, rounds):
    """Grow and shrink the consensus set at `pose`, solving anew each time; pose and covariance move in place.

    Pairs that come or go change the sums in constant time. Returns the score in nats; the consensus set stays in
    `matches`. A direction that no pair fixes is held where it is, and shows in the covariance.
    """
    sums[:] = 0.0
    n = len(scan)
    held = np.full(n, -1, dtype=np.int64)
    for _ in range(rounds):
        match_scan(scan, pose, covariance, walls, starts, items, shape, gates, 0.0, matches)
        changed = False
        for i in range(n):
            w = int(matches[i, 0])
            if w != held[i]:
                changed = True
                if held[i] >= 0:
                    pair(scan, i, walls, held[i], -1.0, sums)
                if w >= 0:
                    pair(scan, i, walls, w, 1.0, sums)
                held[i] = w
        if not changed:
            break
        x = pose[1]
        y = pose[2]
        hold(sums, x, y, 1.0)
        theta, tx, ty, _, _ = joint_solve(sums, pose[0], False)
        joint_information(sums, theta, information)
        hold(sums, x, y, -1.0)
        if not invert3(information, covariance):
            return 0.0
        if abs(wrap(theta - pose[0])) > MAX_TURN or (tx - x) ** 2 + (ty - y) ** 2 > MAX_STEP**2:
            # Nearly parallel pairs, one of them wrong, throw the crossing far away.
            break
        pose[0] = theta
        pose[1] = tx
        pose[2] = ty
    match_scan(scan, pose, covariance, walls, starts, items, shape, gates, 0.0, matches)
    return value_matches(scan, matches)
