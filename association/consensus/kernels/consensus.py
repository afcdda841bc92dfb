"""Compiled growing, shrinking and scoring of the consensus set at a pose.

Everything that scores a set comes from sums that change in constant time when a pair comes or goes: the joint cost and
the information of its pose. Pieces of one wall share the wall's own error: with ``v = sum w phi`` and ``s = sum w``
over the pairs of a wall, and its variance V, the wall's part in the sums is ``sum w phi phi' - v v' / (s + 1 / V)``.
The errors of walls that continue one another are correlated, the less the farther apart they are; these are taken out
of a copy of the sums before it is solved.
"""

import math

import numpy as np

from compiled import kernel
from registration.kernels import invert3, joint_add, joint_cost, joint_information, joint_solve
from registration.layout import Floats, Record, Records

from ...layout import Integers
from ...tables import Place, Workspace
from ...tuning import MAX_STEP, MAX_TURN, ROUNDS, SAME_SHIFT, SORTED_BY_INSERTION, SPRING
from .matching import allow_all, match_scan, wrap
from .ordering import ascending


@kernel
def turning(theta_var: float, gx: float, gy: float, covariance: Record) -> None:
    """Write the covariance of a pose held at a point, and turning about it with `theta_var`.

    ``(gx, gy)`` is that point in the scan frame, rotated: the lever from the sensor to it.
    """
    covariance.xx = theta_var * gy * gy
    covariance.xy = -theta_var * gx * gy
    covariance.yy = theta_var * gx * gx
    covariance.xt = theta_var * gy
    covariance.yt = -theta_var * gx
    covariance.tt = theta_var


@kernel
def hold(sums: Record, x: float, y: float, sign: float) -> None:
    """Add or remove the weak spring that holds a translation where it is."""
    sums.xx += sign * SPRING
    sums.yy += sign * SPRING
    sums.x1 -= sign * SPRING * x
    sums.y1 -= sign * SPRING * y
    sums.one += sign * SPRING * (x * x + y * y)


@kernel
def clear(sums: Record) -> None:
    """Set the sums to those of no pair."""
    sums.cc = 0.0
    sums.cs = 0.0
    sums.cx = 0.0
    sums.cy = 0.0
    sums.c1 = 0.0
    sums.ss = 0.0
    sums.sx = 0.0
    sums.sy = 0.0
    sums.s1 = 0.0
    sums.xx = 0.0
    sums.xy = 0.0
    sums.x1 = 0.0
    sums.yy = 0.0
    sums.y1 = 0.0
    sums.one = 0.0
    sums.wahba_cos = 0.0
    sums.wahba_sin = 0.0
    sums.count = 0.0


@kernel
def forget(share: Record) -> None:
    """Set a wall's share to that of no pair."""
    share.c = 0.0
    share.s = 0.0
    share.x = 0.0
    share.y = 0.0
    share.one = 0.0
    share.weight = 0.0
    share.count = 0.0


@kernel
def change(work: Workspace, wall: Record, seen: Record, i: int, w: int, sign: float) -> None:
    """Add (`sign` 1) or remove (-1) the pair of scan line i, `seen`, on wall w that is held; in constant time."""
    scratch = work.scratch[0]
    line = scratch.line
    line.dx = wall.dx
    line.dy = wall.dy
    line.offset = wall.offset + work.shifts_held[i]
    weight = work.weights_held[i]
    joint_add(scratch.plain, line, seen, weight, sign)
    share = work.shares[w]
    share.count += sign
    if share.count <= 0.0:
        forget(share)
        return
    weight *= sign
    share.c += weight * (line.dx * seen.centroid_y - line.dy * seen.centroid_x)
    share.s += weight * (line.dx * seen.centroid_x + line.dy * seen.centroid_y)
    share.x -= weight * line.dy
    share.y += weight * line.dx
    share.one -= weight * line.offset
    share.weight += weight


@kernel
def take_up(scan: Records, matches: Records, walls: Records, work: Workspace) -> bool:
    """Change the sums of `work` from the pairs that they hold to those of `matches`; tell whether any changed."""
    held = work.held
    shifts = work.shifts_held
    weights = work.weights_held
    changed = False
    for i in range(len(scan)):
        w = matches[i].wall
        h = held[i]
        if w != h or (w >= 0 and abs(matches[i].shift - shifts[i]) > SAME_SHIFT):
            changed = True
            if h >= 0:
                change(work, walls[h], scan[i], i, h, -1.0)
            held[i] = w
            if w >= 0:
                shifts[i] = matches[i].shift
                weights[i] = scan[i].weight
                change(work, walls[w], scan[i], i, w, 1.0)
    return changed


@kernel
def start_over(work: Workspace) -> None:
    """Empty the sums of `work` and the shares of the walls in them."""
    held = work.held
    shares = work.shares
    clear(work.scratch[0].plain)
    for i in range(len(held)):
        if held[i] >= 0:
            forget(shares[held[i]])
            held[i] = -1


@kernel
def list_walls(work: Workspace, ties: Floats) -> tuple[int, int]:
    """List the walls that are held, each once: first those that are tied to none, then the others along their chains.

    Returns how many these and all are, in ``listed`` of `work`; ties by the order of the scan's lines.
    """
    held = work.held
    shares = work.shares
    listed = work.listed
    alone = 0
    tied = len(held)
    for i in range(len(held)):
        w = held[i]
        if w < 0 or shares[w].listed:
            continue
        shares[w].listed = 1
        if ties[w] < 0.0:
            listed[alone] = w
            alone += 1
        else:
            tied -= 1
            listed[tied] = w
    sort_by_ties(listed[tied : len(held)], ties)
    count = alone
    for k in range(tied, len(held)):
        listed[count] = listed[k]
        count += 1
    for k in range(count):
        shares[listed[k]].listed = 0
    return alone, count


@kernel
def sort_by_ties(walls: Integers, ties: Floats) -> None:
    """Put walls (k,) in the order in which they lie along their chains; equal ones stay as they are."""
    n = len(walls)
    if n > SORTED_BY_INSERTION:
        keys = np.empty(n, np.float64)
        for k in range(n):
            keys[k] = ties[walls[k]]
        order = ascending(keys)
        before = walls.copy()
        for k in range(n):
            walls[k] = before[order[k]]
        return
    for k in range(1, n):
        w = walls[k]
        j = k
        while j > 0 and ties[walls[j - 1]] > ties[w]:
            walls[j] = walls[j - 1]
            j -= 1
        walls[j] = w


@kernel
def take_out(sums: Record, share: Record, k: float) -> None:
    """Take the square of a share, times k, out of the sums."""
    sums.cc -= k * share.c * share.c
    sums.cs -= k * share.c * share.s
    sums.cx -= k * share.c * share.x
    sums.cy -= k * share.c * share.y
    sums.c1 -= k * share.c * share.one
    sums.ss -= k * share.s * share.s
    sums.sx -= k * share.s * share.x
    sums.sy -= k * share.s * share.y
    sums.s1 -= k * share.s * share.one
    sums.xx -= k * share.x * share.x
    sums.xy -= k * share.x * share.y
    sums.x1 -= k * share.x * share.one
    sums.yy -= k * share.y * share.y
    sums.y1 -= k * share.y * share.one
    sums.one -= k * share.one * share.one


@kernel
def absorb(common: Record, share: Record, factor: float) -> None:
    """Set what is known of an error to `factor` times what was known of the one before, and add a wall's share."""
    common.c = factor * common.c + share.c
    common.s = factor * common.s + share.s
    common.x = factor * common.x + share.x
    common.y = factor * common.y + share.y
    common.one = factor * common.one + share.one
    common.weight += share.weight


@kernel
def take_out_errors(work: Workspace, ties: Floats, wall_variance: float) -> None:
    """Write the sums of `work` without what the errors of its walls explain.

    The errors of walls along a chain are a Markov process, with the variance V and the correlation r of two that follow
    one another. They are eliminated one after the other: with the weight l and the share b of an error, of which the
    cost is ``l e^2 - 2 e b'x``, and ``q = V (1 - r^2)``, the next one's are ``l / (l q + r^2)`` and
    ``r b / (l q + r^2)``, and ``(b'x)^2 q / (l q + r^2)`` is taken out; of the last one ``(b'x)^2 / l``.
    """
    scratch = work.scratch[0]
    sums = scratch.sums
    shares = work.shares
    copy_sums(scratch.plain, sums)
    if wall_variance <= 0.0:
        return
    alone, count = list_walls(work, ties)
    listed = work.listed
    for k in range(alone):
        share = shares[listed[k]]
        take_out(sums, share, 1.0 / (share.weight + 1.0 / wall_variance))
    common = scratch.common
    for k in range(alone, count):
        share = shares[listed[k]]
        if k == alone:
            forget(common)
            common.weight = 1.0 / wall_variance
            absorb(common, share, 0.0)
        else:
            r = math.exp(ties[listed[k - 1]] - ties[listed[k]])
            free = wall_variance * (1.0 - r * r)
            left = 1.0 / (common.weight * free + r * r)
            take_out(sums, common, free * left)
            common.weight *= left
            absorb(common, share, r * left)
    if count > alone:
        take_out(sums, common, 1.0 / common.weight)


@kernel
def know_others(work: Workspace, ties: Floats, wall_variance: float, estimate: Record) -> None:
    """Write for each wall that is held what is known of its error but by its own pairs, at a pose."""
    shares = work.shares
    listed = work.listed
    alone, count = list_walls(work, ties)
    c = math.cos(estimate.theta)
    s = math.sin(estimate.theta)
    weight = 1.0 / wall_variance
    total = 0.0
    for k in range(count):
        share = shares[listed[k]]
        if k > alone:
            # What those before it say.
            r = math.exp(ties[listed[k - 1]] - ties[listed[k]])
            left = 1.0 / (weight * wall_variance * (1.0 - r * r) + r * r)
            weight *= left
            total *= r * left
        else:
            weight = 1.0 / wall_variance
            total = 0.0
        share.other_weight = weight
        share.other_sum = total
        weight += share.weight
        total += together(share, c, s, estimate)
    weight = 0.0
    total = 0.0
    for k in range(count - 2, alone - 1, -1):
        # What those behind it say.
        after = shares[listed[k + 1]]
        weight += after.weight
        total += together(after, c, s, estimate)
        r = math.exp(ties[listed[k]] - ties[listed[k + 1]])
        left = 1.0 / (weight * wall_variance * (1.0 - r * r) + 1.0)
        weight *= r * r * left
        total *= r * left
        shares[listed[k]].other_weight += weight
        shares[listed[k]].other_sum += total


@kernel
def together(share: Record, c: float, s: float, estimate: Record) -> float:
    """Return how far the pairs of a wall are off it, times their weights, 1/m, at a pose of cosine c and sine s."""
    return share.c * c + share.s * s + share.x * estimate.x + share.y * estimate.y + share.one


@kernel
def copy_sums(one: Record, other: Record) -> None:
    """Write the first sums to the second."""
    other.cc = one.cc
    other.cs = one.cs
    other.cx = one.cx
    other.cy = one.cy
    other.c1 = one.c1
    other.ss = one.ss
    other.sx = one.sx
    other.sy = one.sy
    other.s1 = one.s1
    other.xx = one.xx
    other.xy = one.xy
    other.x1 = one.x1
    other.yy = one.yy
    other.y1 = one.y1
    other.one = one.one
    other.wahba_cos = one.wahba_cos
    other.wahba_sin = one.wahba_sin
    other.count = one.count


@kernel
def solve(sums: Record, estimate: Record, information: Record, value: Record) -> bool:
    """Move a pose to where the sums cost least, and write its covariance, its information and that cost.

    A direction that no pair fixes is held where it is. Returns False where the pose would go too far, and stays:
    nearly parallel pairs, one of them wrong, throw the crossing far away. Then the cost is that of the pose.
    """
    x = estimate.x
    y = estimate.y
    hold(sums, x, y, 1.0)
    theta, tx, ty, cost, _ = joint_solve(sums, estimate.theta, False)
    joint_information(sums, theta, information)
    hold(sums, x, y, -1.0)
    near = abs(wrap(theta - estimate.theta)) <= MAX_TURN and (tx - x) ** 2 + (ty - y) ** 2 <= MAX_STEP**2
    if not invert3(information, estimate):
        value.cost = math.inf
        return False
    if not near:
        value.cost = joint_cost(sums, estimate.theta, x, y)
        return False
    value.cost = cost
    estimate.theta = theta
    estimate.x = tx
    estimate.y = ty
    return True


@kernel
def one_step_cost(sums: Record, estimate: Record) -> float:
    """Return what the sums cost at the paper's estimate: Wahba's rotation first, then the translation that fits it.

    Not what they cost at their optimum, and so no chi-square. A direction that no pair fixes is held where `estimate`
    is.
    """
    c, s = sums.wahba_cos, sums.wahba_sin
    size = math.hypot(c, s)
    if size <= 0.0:
        return joint_cost(sums, estimate.theta, estimate.x, estimate.y)
    c /= size
    s /= size
    xx = sums.xx + SPRING
    yy = sums.yy + SPRING
    x = SPRING * estimate.x - (c * sums.cx + s * sums.sx + sums.x1)
    y = SPRING * estimate.y - (c * sums.cy + s * sums.sy + sums.y1)
    det = xx * yy - sums.xy * sums.xy
    return joint_cost(sums, math.atan2(s, c), (yy * x - sums.xy * y) / det, (xx * y - sums.xy * x) / det)


@kernel
def freedom_taken(information: Record, model: Record) -> float:
    """Return ``log(det(1 + F S)) / 2``, nats: what a set of information F is charged for fixing a pose that was free.

    S is the diagonal of the variances of `model`. Without the 1 this is the marginal likelihood's term.
    """
    d = model.free_distance
    a = model.free_angle
    xx = 1.0 + information.xx * d * d
    yy = 1.0 + information.yy * d * d
    tt = 1.0 + information.tt * a * a
    xy = information.xy * d * d
    xt = information.xt * d * a
    yt = information.yt * d * a
    # By elimination: the minors of a set that fixes one direction only cancel to some 1e-4 nats. No pivot is below 1.
    left = yt - xy / xx * xt
    second = max(1.0, yy - xy / xx * xy)
    third = max(1.0, tt - xt / xx * xt - left / second * left)
    return 0.5 * math.log(xx * second * third)


@kernel
def value_pairs(
    scan: Records, estimate: Record, place: Place, wall_variance: float, matches: Records, work: Workspace
) -> float:
    """Give each match what the set would lose without it at this pose, at least 0 (clutter); return the sum of gains.

    That is its gain less half of the cost that goes with it, the wall's own error taken out before and after.
    """
    walls = place.walls
    shares = work.shares
    c = math.cos(estimate.theta)
    s = math.sin(estimate.theta)
    know_others(work, place.ties, wall_variance, estimate)
    total = 0.0
    for i in range(len(scan)):
        match = matches[i]
        match.worth = 0.0
        w = match.wall
        if w < 0:
            continue
        share = shares[w]
        wall = walls[w]
        weight = scan[i].weight
        x = c * scan[i].centroid_x - s * scan[i].centroid_y + estimate.x
        y = s * scan[i].centroid_x + c * scan[i].centroid_y + estimate.y
        off = wall.dx * y - wall.dy * x - wall.offset - match.shift
        cost = weight * (off * off + scan[i].spread * match.sine * match.sine)
        known = share.weight + share.other_weight
        sum_of_all = together(share, c, s, estimate) + share.other_sum
        cost -= sum_of_all * sum_of_all / known
        sum_of_all -= weight * off
        cost += sum_of_all * sum_of_all / (known - weight)
        worth = match.gain - 0.5 * cost
        if worth > 0.0:
            match.worth = worth
            total += match.gain
        else:
            match.wall = -1
    return total


@kernel
def discount_uneven(scan: Records, matches: Records) -> None:
    """Take from each gain what it costs that the walls under one straight line are beside one another."""
    for i in range(len(scan)):
        match = matches[i]
        if match.wall >= 0 and match.uneven > 0.0:
            match.gain = max(0.0, match.gain - 0.5 * scan[i].weight * match.uneven)


@kernel
def refine(
    scan: Records, estimate: Record, place: Place, terms: Record, matches: Records, work: Workspace, floor: float
) -> float:
    """Grow and shrink the consensus set at a pose, solving anew each time; pose and covariance move in place.

    `matches` come as those of `estimate`, by `match_scan`. Pairs that come or go change the sums of `work` in constant
    time. Returns the score in nats, of which ``value`` of `work` holds the parts; the consensus set stays in `matches`.
    Where the gains in the end do not come to `floor` it returns 0, and the rest is left undone. A direction that no
    pair fixes is held where it is, and shows in the covariance.
    """
    walls = place.walls
    ties = place.ties
    gates = terms.gates
    wall_variance = terms.model.wall_variance
    scratch = work.scratch[0]
    sums = scratch.sums
    information = scratch.information
    value = scratch.value
    possible = work.possible
    allow_all(scan, possible)
    start_over(work)
    clear(sums)
    value.gain = 0.0
    value.cost = 0.0
    value.freedom = 0.0
    discount_uneven(scan, matches)
    changed = take_up(scan, matches, walls, work)
    rounds = 0
    while changed:
        take_out_errors(work, ties, wall_variance)
        if sums.count == 0.0:
            return 0.0  # of pairs that came and went the sums keep rounding, which fixes nothing
        moved = solve(sums, estimate, information, value)
        rounds += 1
        last = rounds == ROUNDS or not moved
        if match_scan(scan, estimate, place, gates, possible, floor if last else 0.0, matches) < 0.0:
            return 0.0
        discount_uneven(scan, matches)
        changed = take_up(scan, matches, walls, work)
        if last:
            break
    value.gain = value_pairs(scan, estimate, place, wall_variance, matches, work)
    changed = take_up(scan, matches, walls, work) or changed
    if changed:
        take_out_errors(work, ties, wall_variance)
    if sums.count == 0.0 or value.gain <= 0.0 or value.gain < floor:
        return 0.0
    if changed or value.cost == math.inf:
        solve(sums, estimate, information, value)
    value.freedom = freedom_taken(information, terms.model)
    return max(0.0, value.gain - 0.5 * value.cost - value.freedom)
