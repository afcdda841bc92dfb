"""Compiled lines of sight: which wall a ray from a pose meets first. See `_match_kernels` for the arrays."""

import math

import numpy as np

from registration.compiling import kernel

from ._match_kernels import invert3, refine, wrap

RAY_SPACING = 0.25  # m, between the points of a segment that rays are sent to
SIGHT_TOLERANCE = 0.2  # m; a wall this near before the end of a ray does not block it
BLOCKED = 2.0  # nats a metre of wall, against a pose, where rays to the consensus set pass through the wall
BLOCKED_CLUTTER = 2.0  # nats a metre, likewise for rays to clutter
BLOCKING_LENGTH = 3.0  # m; beyond it a wall speaks no more
FAR_BEHIND = 25.0  # nats; a candidate so far behind needs no lines of sight
BLOCKING_RAYS = 4.0  # that count fully
MAX_RAYS = 12  # to one segment
END_MARGIN = 0.06  # m; rays keep this far from the ends of a segment, where neighbours meet


@kernel
def first_hit(x, y, dx, dy, limit, walls, starts, items, shape):
    """Return the distance to the first wall along a ray and that wall, ``(limit, -1)`` when there is none before."""
    cell = shape[2]
    columns = int(shape[3])
    rows = int(shape[4])
    fx = (x - shape[0]) / cell
    fy = (y - shape[1]) / cell
    at = 0.0
    # Enter the grid from outside.
    for k in range(2):
        p = fx if k == 0 else fy
        d = dx if k == 0 else dy
        size = shape[3] if k == 0 else shape[4]
        if p < 0.0 or p >= size:
            edge = -p if p < 0.0 else size - p
            if edge * d <= 0.0:
                return limit, -1
            at = max(at, edge / d * cell)
    at += 1e-9 if at > 0.0 else 0.0
    column = math.floor(fx + at / cell * dx)
    row = math.floor(fy + at / cell * dy)
    step_x = 1 if dx > 0.0 else -1
    step_y = 1 if dy > 0.0 else -1
    pace_x = cell / max(abs(dx), 1e-12)
    pace_y = cell / max(abs(dy), 1e-12)
    next_x = ((column + 1 - fx) if dx > 0.0 else (fx - column)) * pace_x
    next_y = ((row + 1 - fy) if dy > 0.0 else (fy - row)) * pace_y
    best = limit
    wall = -1
    while at < best and 0 <= column < columns and 0 <= row < rows:
        here = row * columns + column
        for k in range(starts[here], starts[here + 1]):
            w = items[k]
            wx = walls[w, 0]
            wy = walls[w, 1]
            across = wx * dy - wy * dx
            if abs(across) > 1e-9:
                reach = (walls[w, 2] - wx * y + wy * x) / across
                if reach > 1e-6 and reach < best:
                    along = wx * (x + reach * dx) + wy * (y + reach * dy)
                    if along >= walls[w, 3] and along <= walls[w, 4]:
                        best = reach
                        wall = w
        at = min(next_x, next_y)
        if next_x < next_y:
            column += step_x
            next_x += pace_x
        else:
            row += step_y
            next_y += pace_y
    return best, wall


@kernel
def count_blockers(
    scan, matches, viewpoint, pose, walls, starts, items, shape, tolerance, to_matched, to_clutter, touched
):  # fmt: skip
    """Count for every wall the rays to segments that pass through it more than `tolerance` metres before their end.

    ``to_matched[w]`` counts rays to segments of the consensus set, ``to_clutter[w]`` those to the others; both (m,) are
    0 before. Returns how many walls that are, listed in `touched` (m,).
    """
    count = 0
    c = math.cos(pose[0])
    s = math.sin(pose[0])
    x = c * viewpoint[0] - s * viewpoint[1] + pose[1]
    y = s * viewpoint[0] + c * viewpoint[1] + pose[2]
    for i in range(len(scan)):
        length = scan[i, 4]
        rays = min(MAX_RAYS, max(1, math.ceil(length / RAY_SPACING)))
        usable = max(0.0, length - 2.0 * END_MARGIN)
        for k in range(rays):
            along = ((k + 0.5) / rays - 0.5) * usable
            px = scan[i, 2] + along * scan[i, 0]
            py = scan[i, 3] + along * scan[i, 1]
            gx = c * px - s * py + pose[1] - x
            gy = s * px + c * py + pose[2] - y
            distance = math.sqrt(gx * gx + gy * gy)
            limit = distance - tolerance
            if limit > 0.0:
                _, w = first_hit(x, y, gx / distance, gy / distance, limit, walls, starts, items, shape)
                if w >= 0:
                    if to_matched[w] + to_clutter[w] == 0:
                        touched[count] = w
                        count += 1
                    if matches[i, 0] >= 0.0:
                        to_matched[w] += 1
                    else:
                        to_clutter[w] += 1
    return count


@kernel
def sight_penalty(to_matched, to_clutter, touched, count, walls):
    """Return what the walls that should have blocked the view speak against a pose, nats, at least 0; clear the counts.

    A wall counts once, however many rays pass, and by its length: short ones on a map made by a robot are often people
    and carts that have gone since. Rays to clutter prove less than rays to the consensus set, yet many walls between
    the sensor and what it saw are unlikely at the right pose.
    """
    total = 0.0
    for k in range(count):
        w = touched[k]
        length = min(BLOCKING_LENGTH, walls[w, 4] - walls[w, 3])
        total += BLOCKED * length * min(1.0, to_matched[w] / BLOCKING_RAYS)
        total += BLOCKED_CLUTTER * length * min(1.0, to_clutter[w] / BLOCKING_RAYS)
        to_matched[w] = 0
        to_clutter[w] = 0
    return total


@kernel
def rank(
    scan, poses, walls, starts, items, shape, gates, viewpoint, sighted, scores, covariances, shares, reliabilities,
    matches,
):  # fmt: skip
    """Refine the candidate poses (k, 3) in place and score them with the lines of sight.

    Writes scores (k,) in nats, covariances (k, 3, 3) of (x, y, theta), the matched share of the scan's length (k,), the
    paper's reliability (k,), Eq. (28), and the matches (k, n, 5).
    """
    sums = np.empty(18)
    information = np.empty((3, 3))
    to_matched = np.zeros(len(walls), dtype=np.int64)
    to_clutter = np.zeros(len(walls), dtype=np.int64)
    touched = np.empty(len(walls), dtype=np.int64)
    best = 0.0
    length = 0.0
    for i in range(len(scan)):
        length += scan[i, 4]
    for k in range(len(poses)):
        covariance = covariances[k]
        covariance[:] = 0.0
        covariance[0, 0] = 1e-4
        covariance[1, 1] = 1e-4
        covariance[2, 2] = 1e-6
        scores[k] = refine(
            scan, poses[k], covariance, walls, starts, items, shape, gates, matches[k], sums, information, 3
        )
        det = sums[9] * sums[12] - sums[10] * sums[10]
        weight = sums[9] + sums[12]
        reliabilities[k] = min(1.0, 2.0 * math.sqrt(max(det, 0.0)) / weight) if weight > 0.0 else 0.0
        found = 0.0
        for i in range(len(scan)):
            if matches[k, i, 0] >= 0.0:
                found += scan[i, 4]
        shares[k] = found / length
        # The candidates come best first: what is far behind is no rival, its score may stay too good.
        if sighted and scores[k] > best - FAR_BEHIND:
            blockers = count_blockers(
                scan, matches[k], viewpoint, poses[k], walls, starts, items, shape, SIGHT_TOLERANCE, to_matched,
                to_clutter, touched,
            )  # fmt: skip
            scores[k] -= sight_penalty(to_matched, to_clutter, touched, blockers, walls)
            best = max(best, scores[k])


@kernel
def distinct(poses, covariances, order, most, rules):
    """Pick from `order`, the best first, at most `most` poses (k, 3) without those that a better one stands for.

    A pose stands for those that are near, within ``rules[0]`` metres and ``rules[1]`` radians, and for those that its
    own covariance does not tell from it, at less than ``rules[2]`` squared deviations: a family along a corridor is one
    explanation. Returns the places in `poses`.
    """
    kept = np.empty(min(most, len(order)), dtype=np.int64)
    informations = np.empty((len(kept), 3, 3))
    known = np.empty(len(kept), dtype=np.bool_)
    count = 0
    for i in order:
        if count == len(kept):
            break
        stands = False
        for k in range(count):
            better = kept[k]
            x = poses[i, 1] - poses[better, 1]
            y = poses[i, 2] - poses[better, 2]
            turn = wrap(poses[i, 0] - poses[better, 0])
            if math.sqrt(x * x + y * y) < rules[0] and abs(turn) < rules[1]:
                stands = True
                break
            f = informations[k]
            square = f[0, 0] * x * x + f[1, 1] * y * y + f[2, 2] * turn * turn
            square += 2.0 * (f[0, 1] * x * y + f[0, 2] * x * turn + f[1, 2] * y * turn)
            if known[k] and square < rules[2]:
                stands = True
                break
        if not stands:
            kept[count] = i
            known[count] = invert3(covariances[i], informations[count])
            count += 1
    return kept[:count]
