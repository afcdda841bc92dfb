"""Compiled growing, shrinking and scoring of the consensus set at a pose.

Everything that scores a set comes from sums that change in constant time when a pair comes or goes: the joint cost and
the information of its pose. Pieces of one wall share the wall's own error: with ``v = sum w phi`` and ``s = sum w``
over the pairs of a wall, and its variance V, the wall's part in the sums is ``sum w phi phi' - v v' / (s + 1 / V)``.
"""

import math

from registration.compiling import inlined, kernel
from registration.kernels import invert3, joint_add, joint_cost, joint_information, joint_solve
from registration.layout import Record, Records

from ..tables import Place, Workspace
from ..tuning import MAX_STEP, MAX_TURN, ROUNDS, SPRING
from .matching import allow_all, match_scan, wrap


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


@inlined
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
def take_out(sums: Record, share: Record, wall_variance: float, sign: float) -> None:
    """Take what a wall's own error explains out of the sums (`sign` 1), or put it back (-1)."""
    if share.count <= 0.0 or wall_variance <= 0.0:
        return
    k = sign / (share.weight + 1.0 / wall_variance)
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


@inlined
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
def change(
    sums: Record, share: Record, wall: Record, seen: Record, weight: float, wall_variance: float, sign: float
) -> None:
    """Add (`sign` 1) or remove (-1) one pair of a wall, whose `share` in the sums changes with it; in constant time."""
    take_out(sums, share, wall_variance, -1.0)
    joint_add(sums, wall, seen, weight, sign)
    share.count += sign
    if share.count <= 0.0:
        forget(share)
        return
    w = sign * weight
    share.c += w * (wall.dx * seen.centroid_y - wall.dy * seen.centroid_x)
    share.s += w * (wall.dx * seen.centroid_x + wall.dy * seen.centroid_y)
    share.x -= w * wall.dy
    share.y += w * wall.dx
    share.one -= w * wall.offset
    share.weight += w
    take_out(sums, share, wall_variance, 1.0)


@kernel
def take_up(scan: Records, matches: Records, walls: Records, wall_variance: float, work: Workspace) -> bool:
    """Change the sums of `work` from the pairs that they hold to those of `matches`; tell whether any changed."""
    held = work.held
    shares = work.shares
    sums = work.scratch[0].sums
    changed = False
    for i in range(len(scan)):
        w = matches[i].wall
        h = held[i]
        if w != h:
            changed = True
            if h >= 0:
                change(sums, shares[h], walls[h], scan[i], scan[i].weight, wall_variance, -1.0)
            if w >= 0:
                change(sums, shares[w], walls[w], scan[i], scan[i].weight, wall_variance, 1.0)
            held[i] = w
    return changed


@kernel
def start_over(work: Workspace) -> None:
    """Empty the sums of `work` and the shares of the walls in them."""
    held = work.held
    shares = work.shares
    clear(work.scratch[0].sums)
    for i in range(len(held)):
        if held[i] >= 0:
            forget(shares[held[i]])
            held[i] = -1


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
    scan: Records, estimate: Record, walls: Records, wall_variance: float, matches: Records, work: Workspace
) -> float:
    """Give each match what the set would lose without it at this pose, at least 0 (clutter); return the sum of gains.

    That is its gain less half of the cost that goes with it, the wall's own error taken out before and after.
    """
    shares = work.shares
    c = math.cos(estimate.theta)
    s = math.sin(estimate.theta)
    inverse = 1.0 / wall_variance
    total = 0.0
    for i in range(len(scan)):
        matches[i].worth = 0.0
        w = matches[i].wall
        if w < 0:
            continue
        share = shares[w]
        wall = walls[w]
        weight = scan[i].weight
        x = c * scan[i].centroid_x - s * scan[i].centroid_y + estimate.x
        y = s * scan[i].centroid_x + c * scan[i].centroid_y + estimate.y
        off = wall.dx * y - wall.dy * x - wall.offset
        sine = matches[i].sine
        cost = weight * (off * off + scan[i].spread * sine * sine)
        together = share.c * c + share.s * s + share.x * estimate.x + share.y * estimate.y + share.one
        cost -= together * together / (share.weight + inverse)
        together -= weight * off
        cost += together * together / (share.weight - weight + inverse)
        gain = scan[i].gain * matches[i].overlap
        worth = gain - 0.5 * cost
        if worth > 0.0:
            matches[i].worth = worth
            total += gain
        else:
            matches[i].wall = -1
    return total


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
    gates = terms.gates
    wall_variance = terms.model.wall_variance
    scratch = work.scratch[0]
    sums = scratch.sums
    information = scratch.information
    value = scratch.value
    possible = work.possible
    allow_all(scan, possible)
    start_over(work)
    value.gain = 0.0
    value.cost = 0.0
    value.freedom = 0.0
    changed = take_up(scan, matches, walls, wall_variance, work)
    rounds = 0
    while changed:
        if sums.count == 0.0:
            return 0.0  # of pairs that came and went the sums keep rounding, which fixes nothing
        moved = solve(sums, estimate, information, value)
        rounds += 1
        last = rounds == ROUNDS or not moved
        if match_scan(scan, estimate, place, gates, possible, floor if last else 0.0, matches) < 0.0:
            return 0.0
        changed = take_up(scan, matches, walls, wall_variance, work)
        if last:
            break
    value.gain = value_pairs(scan, estimate, walls, wall_variance, matches, work)
    changed = take_up(scan, matches, walls, wall_variance, work) or changed
    if sums.count == 0.0 or value.gain <= 0.0 or value.gain < floor:
        return 0.0
    if changed or value.cost == math.inf:
        solve(sums, estimate, information, value)
    value.freedom = freedom_taken(information, terms.model)
    return max(0.0, value.gain - 0.5 * value.cost - value.freedom)
