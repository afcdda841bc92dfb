"""Compiled list of the best poses so far, and what a prior says of a pose."""

from registration.compiling import inlined, kernel

from ._match_kernels import wrap

# Columns of `found` (k, 5): value (score and prior together), theta, x, y, score.
FOUND_COLUMNS = 5
# Places of `best`: highest value found; least value on a full list.
BEST_SIZE = 2
# Places of `rules`: share of the best value that a pose must reach to be kept; distance and angle of distinct poses;
# share of the best value that makes a rival, up to which the search goes on.
# Places of `prior`: kind, x, y, theta, then xx, xy, xt, yy, yt, tt of the information matrix, or radius and angle.
NO_PRIOR, SOFT_PRIOR, HARD_PRIOR = range(3)
PRIOR_SIZE = 10
SOFT_FLOOR = -20.0  # nats; the most that a soft prior speaks against a pose
INSIDE = 1e6  # nats; puts every pose within a hard prior's window before those outside


@kernel
def prior_value(prior, theta, x, y):
    """Return what the prior says of a pose, nats: at most 0 for a soft one, `INSIDE` or 0 for a hard one."""
    if prior[0] == NO_PRIOR:
        return 0.0
    dx = x - prior[1]
    dy = y - prior[2]
    turn = wrap(theta - prior[3])
    if prior[0] == HARD_PRIOR:
        return INSIDE if dx * dx + dy * dy <= prior[4] * prior[4] and abs(turn) <= prior[5] else 0.0
    square = (
        prior[4] * dx * dx
        + 2.0 * prior[5] * dx * dy
        + 2.0 * prior[6] * dx * turn
        + prior[7] * dy * dy
        + 2.0 * prior[8] * dy * turn
        + prior[9] * turn * turn
    )
    return max(SOFT_FLOOR, -0.5 * square)


@kernel
def keep(found, count, best, pose, score, value, distance, angle):
    """Put a pose among the best, at most one within `distance` metres and `angle` radians; ties keep the earlier."""
    n = count[0]
    near = -1
    worst = 0
    for k in range(n):
        if (
            abs(found[k, 2] - pose[1]) < distance
            and abs(found[k, 3] - pose[2]) < distance
            and abs(wrap(found[k, 1] - pose[0])) < angle
            and (near < 0 or found[k, 0] > found[near, 0])
        ):
            near = k
        if found[k, 0] < found[worst, 0]:
            worst = k
    if near >= 0:
        place = near
        if value <= found[near, 0]:
            return
    elif n < len(found):
        place = n
        count[0] = n + 1
    else:
        place = worst
        if value <= found[worst, 0]:
            return
    found[place, 0] = value
    found[place, 1] = pose[0]
    found[place, 2] = pose[1]
    found[place, 3] = pose[2]
    found[place, 4] = score
    if count[0] == len(found):
        least = found[0, 0]
        for k in range(1, len(found)):
            least = min(least, found[k, 0])
        best[1] = least


@inlined
def floor_of(rules, best, bonus):
    """Return the score that a pose must reach to be kept, given what the prior says of it."""
    return max(rules[0] * best[0], best[1]) - bonus


@kernel
def offer(found, count, best, rules, prior, pose, score):
    """Keep a refined pose if it is worth it."""
    bonus = prior_value(prior, pose[0], pose[1], pose[2])
    if prior[0] == HARD_PRIOR:
        if bonus < INSIDE:
            return
        bonus = 0.0
    if score <= 0.0 or score < floor_of(rules, best, bonus):
        return
    keep(found, count, best, pose, score, score + bonus, rules[1], rules[2])
    best[0] = max(best[0], score + bonus)
