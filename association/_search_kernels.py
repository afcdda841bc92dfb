"""Compiled search: from bases to scored poses. See `_match_kernels` for the arrays and their columns."""

import math

import numpy as np

from registration.compiling import inlined, kernel

from ._keeping_kernels import HARD_PRIOR, floor_of, offer, prior_value
from ._match_kernels import SECTOR_BITS, SECTORS, angle_spreads, match_scan, may_score, refine, turning, wrap

BASE_SLACK = 0.2  # m; how far a scan segment of a base may stick out at an end of its wall
BASE_SLACK_SHARE = 0.1  # of its length
MIN_CROSSING = 0.1  # sine of the least angle between the walls of a base
MIN_CROSSING_BASE = 0.3  # sine of the least angle between the scan segments of a base

# Places of `progress`: bases gone through, anchor within the base, hypotheses, verified ones, base under way or -1.

WHOLE_OVERLAP = 0.5  # least overlap from which the raster of directions can be asked
WINDOW_MARGIN = 0.5  # m, and
WINDOW_TURN = 0.1  # rad; what lies farther outside a hard prior's window is not refined into it

COST_REJECTED = 10  # in tests of a wall
COST_HYPOTHESIS = 50
COST_REFINE = 800


@inlined
def end_slack(length):
    """How far a scan segment, as part of a base, may stick out at each end of its wall."""
    return BASE_SLACK + BASE_SLACK_SHARE * length


@inlined
def least_length(length):
    """How long a wall is at least under a scan segment of a base."""
    return length - 2.0 * end_slack(length)


@kernel
def anchors(length, runs, bin_starts, out):
    """List the runs long enough for a scan segment of `length` metres."""
    n = 0
    need = least_length(length)
    for b in range(len(bin_starts) - 1):
        for w in range(bin_starts[b], bin_starts[b + 1]):
            if runs[w, 4] - runs[w, 3] < need:
                break
            out[n] = w
            n += 1
    return n


@kernel
def base_pose(scan, a, b, runs, wa, wb, pose):
    """Write the pose that puts both midpoints on their lines and splits the misfit of the angles by their variances.

    Returns whether both segments then lie within the ends of their walls, up to their slack.
    """
    gap = wrap(runs[wb, 5] - runs[wa, 5] - scan[b, 5] + scan[a, 5])
    theta = runs[wa, 5] - scan[a, 5] + gap * scan[a, 10] / (scan[a, 10] + scan[b, 10])
    c = math.cos(theta)
    s = math.sin(theta)
    det = runs[wa, 0] * runs[wb, 1] - runs[wa, 1] * runs[wb, 0]
    # n . t = p - n . R m for both, with n = (-d_y, d_x).
    ax = c * scan[a, 2] - s * scan[a, 3]
    ay = s * scan[a, 2] + c * scan[a, 3]
    bx = c * scan[b, 2] - s * scan[b, 3]
    by = s * scan[b, 2] + c * scan[b, 3]
    ra = runs[wa, 2] + runs[wa, 1] * ax - runs[wa, 0] * ay
    rb = runs[wb, 2] + runs[wb, 1] * bx - runs[wb, 0] * by
    tx = (ra * runs[wb, 0] - rb * runs[wa, 0]) / det
    ty = (ra * runs[wb, 1] - rb * runs[wa, 1]) / det
    pose[0] = theta
    pose[1] = tx
    pose[2] = ty
    along = runs[wa, 0] * (ax + tx) + runs[wa, 1] * (ay + ty)
    half = 0.5 * scan[a, 4] - end_slack(scan[a, 4])
    if along - half < runs[wa, 3] or along + half > runs[wa, 4]:
        return False
    along = runs[wb, 0] * (bx + tx) + runs[wb, 1] * (by + ty)
    half = 0.5 * scan[b, 4] - end_slack(scan[b, 4])
    return along - half >= runs[wb, 3] and along + half <= runs[wb, 4]


@kernel
def try_pose(
    scan, gx, gy, theta_var, pose, walls, starts, items, shape, raster_shape, bits, gates, rules, prior, found, count,
    best, progress, spreads, matches, sums, information, covariance,
):  # fmt: skip
    """Score a proposed pose, held at the lever ``(gx, gy)`` from the sensor; keep it if it is among the best.

    Returns what it cost, in tests of a wall.
    """
    progress[2] += 1
    bonus = prior_value(prior, pose[0], pose[1], pose[2])
    if prior[0] == HARD_PRIOR:
        bonus = 0.0
        if (
            math.hypot(pose[1] - prior[1], pose[2] - prior[2]) > prior[4] + WINDOW_MARGIN
            or abs(wrap(pose[0] - prior[3])) > prior[5] + WINDOW_TURN
        ):
            return COST_REJECTED
    floor = floor_of(rules, best, bonus)
    if gates[5] >= WHOLE_OVERLAP and not may_score(scan, pose, spreads, raster_shape, bits, floor):
        return COST_REJECTED
    turning(theta_var, gx, gy, covariance)
    if match_scan(scan, pose, covariance, walls, starts, items, shape, gates, floor, matches) < 0.0:
        return COST_HYPOTHESIS
    progress[3] += 1
    score = refine(scan, pose, covariance, walls, starts, items, shape, gates, matches, sums, information, 3)
    offer(found, count, best, rules, prior, pose, score)
    return COST_REFINE


@kernel
def search_base(
    scan, a, b, runs, bin_starts, walls, starts, items, shape, raster_shape, bits, sector_starts, sector_items,
    sector_shape, gates, rules, prior, found, count, best, progress, resume, budget,
):  # fmt: skip
    """Go through all pairs of runs that fit the base of scan segments `a`, which slides, and `b`.

    A run under `a` fixes the rotation and leaves one slide; the grid is walked along what the midpoint of `b` then
    sweeps. The final angle splits the misfit of both, so that b turns about a by up to `swing` metres: the ends are
    tested loosely until then. Goes on from the anchor where `progress` stands, at the slide ``resume[0]`` unless that
    is -inf, and stops when `budget` tests are used up. Returns the tests that it took; ``progress[1]`` is back
    at 0, and ``resume[0]`` at -inf, when the base is done.

    The walk stands here whole, and reads arrays only by element: see `match_scan`.
    """
    n = len(scan)
    pose = np.empty(3)
    matches = np.empty((n, 5))
    sums = np.empty(18)
    information = np.empty((3, 3))
    covariance = np.empty((3, 3))
    anchor_list = np.empty(len(runs), dtype=np.int32)
    n_anchors = anchors(scan[a, 4], runs, bin_starts, anchor_list)
    va = scan[a, 10]
    vb = scan[b, 10]
    theta_var = va * vb / (va + vb)
    spreads = np.empty(n)
    angle_spreads(scan, theta_var, gates, spreads)
    tolerance = min(gates[4], max(gates[3], gates[0] * math.sqrt(va + vb)))
    cos_tolerance = 1.0 - 0.5 * tolerance * tolerance
    turn = scan[b, 5] - scan[a, 5]
    mx = scan[b, 2] - scan[a, 2]
    my = scan[b, 3] - scan[a, 3]
    swing = tolerance * va / (va + vb) * math.hypot(mx, my) / abs(math.sin(turn))
    half_a = 0.5 * scan[a, 4] - end_slack(scan[a, 4]) - swing
    half_b = 0.5 * scan[b, 4] - end_slack(scan[b, 4]) - swing
    adx = scan[a, 0]
    ady = scan[a, 1]
    bdx = scan[b, 0]
    bdy = scan[b, 1]
    pin_x = 0.5 * (scan[a, 2] + scan[b, 2])
    pin_y = 0.5 * (scan[a, 3] + scan[b, 3])
    x0 = sector_shape[0]
    y0 = sector_shape[1]
    cell = sector_shape[2]
    per_cell = 1.0 / cell
    columns = int(sector_shape[3])
    rows = int(sector_shape[4])
    per_radian = SECTORS / (2.0 * math.pi)
    spread = tolerance * per_radian
    spent = len(bin_starts)
    # A hard prior says about where the midpoint of a is.
    windowed = prior[0] == HARD_PRIOR
    widest = prior[5] + WINDOW_TURN + tolerance
    nearest_x = math.cos(prior[3]) * scan[a, 2] - math.sin(prior[3]) * scan[a, 3] + prior[1]
    nearest_y = math.sin(prior[3]) * scan[a, 2] + math.cos(prior[3]) * scan[a, 3] + prior[2]
    lever = 2.0 * math.hypot(scan[a, 2], scan[a, 3]) * math.sin(0.5 * min(widest, math.pi))
    window = prior[4] + WINDOW_MARGIN + lever + swing
    while progress[1] < n_anchors:
        wa = anchor_list[progress[1]]
        progress[1] += 1
        spent += 5
        dx = runs[wa, 0]
        dy = runs[wa, 1]
        at = max(runs[wa, 3] + half_a, resume[0])
        high = runs[wa, 4] - half_a
        resume[0] = -math.inf
        entered = at
        if windowed:
            away = dx * nearest_y - dy * nearest_x - runs[wa, 2]
            if abs(away) > window or abs(wrap(runs[wa, 5] - scan[a, 5] - prior[3])) > widest:
                continue
            along = dx * nearest_x + dy * nearest_y
            at = max(at, along - window)
            high = min(high, along + window)
        # Rotation that lays a on the wall, and the direction that b then has.
        c = dx * adx + dy * ady
        s = dy * adx - dx * ady
        tdx = c * bdx - s * bdy
        tdy = s * bdx + c * bdy
        # Midpoint of b with a's midpoint at abscissa 0 of its wall; the slide is that abscissa.
        x = c * mx - s * my - dy * runs[wa, 2]
        y = s * mx + c * my + dx * runs[wa, 2]
        fx = (x + at * dx - x0) * per_cell
        fy = (y + at * dy - y0) * per_cell
        column = math.floor(fx)
        row = math.floor(fy)
        step_x = 1 if dx > 0.0 else -1
        step_y = 1 if dy > 0.0 else -1
        pace_x = cell / max(abs(dx), 1e-12)
        pace_y = cell / max(abs(dy), 1e-12)
        next_x = at + ((column + 1 - fx) if dx > 0.0 else (fx - column)) * pace_x
        next_y = at + ((row + 1 - fy) if dy > 0.0 else (fy - row)) * pace_y
        # The sectors that the direction of b may lie in, one or two.
        turned = (runs[wa, 5] + turn + math.pi) * per_radian + 0.5
        first_sector = math.floor(turned - spread)
        more_sectors = math.floor(turned + spread) - first_sector
        while at <= high:
            until = min(next_x, next_y)
            if 0 <= column < columns and 0 <= row < rows:
                here = row * columns + column
                for k in range(sector_starts[here], sector_starts[here + 1]):
                    if (sector_items[k] - first_sector) & (SECTORS - 1) > more_sectors:
                        continue
                    wb = sector_items[k] >> SECTOR_BITS
                    spent += 1
                    wx = runs[wb, 0]
                    wy = runs[wb, 1]
                    across = wx * dy - wy * dx
                    if wx * tdx + wy * tdy < cos_tolerance or abs(across) < MIN_CROSSING:
                        continue
                    slide = (runs[wb, 2] - wx * y + wy * x) / across
                    # A wall is listed in several cells: it counts where the crossing is.
                    if slide < at or slide >= until or slide > high:
                        continue
                    along = wx * (x + slide * dx) + wy * (y + slide * dy)
                    if along - half_b < runs[wb, 3] or along + half_b > runs[wb, 4]:
                        continue
                    if base_pose(scan, a, b, runs, wa, wb, pose):
                        gx = c * pin_x - s * pin_y
                        gy = s * pin_x + c * pin_y
                        spent += try_pose(
                            scan, gx, gy, theta_var, pose, walls, starts, items, shape, raster_shape, bits, gates,
                            rules, prior, found, count, best, progress, spreads, matches, sums, information,
                            covariance,
                        )  # fmt: skip
            at = until
            if next_x < next_y:
                column += step_x
                next_x += pace_x
            else:
                row += step_y
                next_y += pace_y
            # Rounding may have led back into the cell before, which leaves `at` where it is.
            if spent > budget and entered < at <= high:
                progress[1] -= 1
                resume[0] = at
                return spent
        if spent > budget and progress[1] < n_anchors:
            return spent
    progress[1] = 0
    progress[0] += 1
    return spent


@kernel
def search_slides(
    scan, a, runs, bin_starts, walls, starts, items, shape, raster_shape, bits, gates, rules, prior, found, count, best,
    progress, spacing, place, budget,
):  # fmt: skip
    """Lay scan segment `a` on every run that is long enough, at slides `spacing` metres apart, and keep the best.

    For scans without a base: what is found is a family of poses, fixed across the walls and free along them. Goes on
    from the anchor and the step at `place` (2,), and returns False when `budget` tests are used up before the end.
    """
    spent = 0
    n = len(scan)
    pose = np.empty(3)
    matches = np.empty((n, 5))
    sums = np.empty(18)
    information = np.empty((3, 3))
    covariance = np.empty((3, 3))
    spreads = np.empty(n)
    angle_spreads(scan, scan[a, 10], gates, spreads)
    anchor_list = np.empty(len(runs), dtype=np.int32)
    n_anchors = anchors(scan[a, 4], runs, bin_starts, anchor_list)
    while place[0] < n_anchors:
        w = anchor_list[place[0]]
        place[0] += 1
        first = place[1]
        place[1] = 0
        half = 0.5 * scan[a, 4] - end_slack(scan[a, 4])
        low = runs[w, 3] + half
        high = runs[w, 4] - half
        theta = runs[w, 5] - scan[a, 5]
        c = math.cos(theta)
        s = math.sin(theta)
        gx = c * scan[a, 2] - s * scan[a, 3]
        gy = s * scan[a, 2] + c * scan[a, 3]
        if prior[0] == HARD_PRIOR:
            middle = runs[w, 0] * (prior[1] + gx) + runs[w, 1] * (prior[2] + gy)
            low = max(low, middle - prior[4])
            high = min(high, middle + prior[4])
            if low > high or abs(wrap(theta - prior[3])) > prior[5] + WINDOW_TURN:
                continue
        steps = max(1, math.ceil((high - low) / spacing))
        var = scan[a, 10]
        for j in range(first, steps):
            if spent > budget:
                place[0] -= 1
                place[1] = j
                return False
            slide = low + (j + 0.5) / steps * (high - low)
            pose[0] = theta
            pose[1] = runs[w, 0] * slide - runs[w, 1] * runs[w, 2] - gx
            pose[2] = runs[w, 1] * slide + runs[w, 0] * runs[w, 2] - gy
            spent += try_pose(
                scan, gx, gy, var, pose, walls, starts, items, shape, raster_shape, bits, gates, rules, prior, found,
                count, best, progress, spreads, matches, sums, information, covariance,
            )  # fmt: skip
    return True
