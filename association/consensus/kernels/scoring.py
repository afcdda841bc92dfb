"""Turn poses into scored consensus sets: match, solve, match again, drop what costs more than it gains, score."""

from __future__ import annotations

import math

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import HARD_PRIOR, NO_PRIOR
from ...tables import Place, Question, ScoreRules, ScoreWork
from ...tuning import DIRECTION_BINS, INSIDE
from ..tuning import MOST_BRIDGED, ROUNDS, SAME_SHIFT
from .geometry import prior_value
from .pairs import (
    add_wall,
    begin_cover,
    begin_way,
    change_pair,
    copy_sums,
    end_way,
    follow,
    misfit_of,
    put_line,
    scale_wall,
    solve_pose,
    subtract_square,
    write_match,
)

BINS_PER_RADIAN = DIRECTION_BINS / (2.0 * math.pi)
GATE_MARGIN = 1.01  # over a gate: angles are tested by a cosine to the second order
SUM_SLACK = 1e-9  # nats, rounding


@kernel
def log_determinant(information: Record, model: Record) -> float:
    """Return ``log(det(1 + F S)) / 2``, nats: what a set of information F is charged for fixing a pose that was free.

    S is the covariance of a pose before anything fixes it, see `MODEL`.
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
def residual_of_wall(own: Record, c: float, s: float, pose: Record) -> float:
    """Return how far the pairs of a wall are off it, times their weights, 1/m, at a pose of cosine c and sine s."""
    return own.c * c + own.s * s + own.x * pose.x + own.y * pose.y + own.one


@kernel
def score_poses(
    question: Question, place: Place, poses: Records, rules: ScoreRules, scores: Records, matches: Records,
    work: ScoreWork,
) -> tuple[float, int]:  # fmt: skip
    """Refine poses with their consensus sets, and score these; return the best value, and how many poses were refined.

    A pose that cannot reach the floor of `rules` gets the score 0. The score is the sum of gains less half of the
    chi-square, walls' own errors eliminated, less the log-determinant; the value is the score and the prior.

    1. Match every scan line to the wall that it lies on best, the most informative lines first.
    2. Add and remove the pairs that changed, in constant time each, eliminate the walls' errors, solve for the pose;
       match again, up to `ROUNDS` times.
    3. Drop the pairs whose loss would raise the score, and solve again.

    Parameters
    ----------
    question : Question
    place : Place
    poses : (k,) of `ESTIMATE`
        Each with the covariance that gates are widened by; replaced by the refined ones.
    rules : ScoreRules
    scores : (k,) of `SET_SCORE`
        Written.
    matches : (k, n) or (1, n) of `MATCH`
        Written; of (1, n) the last one stays.
    work : ScoreWork
    """
    scan = question.scan
    terms = question.terms[0]
    gates = terms.gates
    model = terms.model
    prior = terms.prior
    walls = place.walls
    bin_starts = place.bin_starts
    ties = place.ties
    starts = place.grid.starts
    items = place.grid.items
    shape = place.grid.shape[0]
    parallel = rules.parallel
    rule = rules.rule[0]
    held = work.held
    wall_sums = work.wall_sums
    listed = work.listed
    scratch = work.scratch[0]
    line = scratch.line
    cover = scratch.cover
    sums = scratch.sums
    plain = scratch.plain
    angles = scratch.angles
    common = scratch.common
    solution = scratch.solution
    n = len(scan)
    total_gain = SUM_SLACK
    for i in range(n):
        total_gain += scan[i].gain
    best_value = rule.best_value
    refined = 0
    for k in range(len(poses)):
        pose = poses[k]
        out = scores[k]
        found = matches[k if len(matches) > 1 else 0]
        out.score = 0.0
        out.value = 0.0
        bonus = 0.0
        if prior.kind != NO_PRIOR and prior.kind != HARD_PRIOR:
            bonus = prior_value(prior, pose)
        least = max(rule.kept_fraction * best_value, rule.least_value)
        floor = least - bonus + rule.least_freedom if least > 0.0 else 0.0
        for i in range(n):
            held[i].wall = -1
        copy_sums(work.nothing[0], plain)
        angles.xx = 0.0
        angles.xy = 0.0
        angles.yy = 0.0
        rounds = 0
        last = False
        possible = True
        changed = True
        while True:
            # Match every scan line.
            c = math.cos(pose.theta)
            s = math.sin(pose.theta)
            threshold = floor if rounds == 0 or last else 0.0
            gain = 0.0
            left = total_gain
            for i in range(n):
                match = found[i]
                match.wall = -1
                match.overlap = 0.0
                match.gain = 0.0
                left -= scan[i].gain
                px = c * scan[i].x - s * scan[i].y + pose.x
                py = s * scan[i].x + c * scan[i].y + pose.y
                fx = (px - shape.x0) / shape.cell
                fy = (py - shape.y0) / shape.cell
                if fx >= 0.0 and fy >= 0.0 and fx < shape.columns and fy < shape.rows:
                    cell = int(fy) * shape.columns + int(fx)
                    first_item = starts[cell]
                    end_item = starts[cell + 1]
                    if first_item < end_item:
                        put_line(scan[i], pose, c, s, gates, line)
                        turned = (pose.theta + scan[i].angle + math.pi) * BINS_PER_RADIAN
                        spread = GATE_MARGIN * line.angle_gate * BINS_PER_RADIAN
                        lowest = math.floor(turned - spread) % DIRECTION_BINS
                        highest = math.floor(turned + spread) % DIRECTION_BINS
                        low_wall = bin_starts[lowest]
                        high_wall = bin_starts[highest + 1]
                        least_misfit = 1e300
                        to_follow = MOST_BRIDGED
                        for item in range(first_item, end_item):
                            w = items[item]
                            if lowest <= highest:
                                if w < low_wall or w >= high_wall:
                                    continue
                            elif high_wall <= w < low_wall:
                                continue
                            wall = walls[w]
                            if not begin_cover(wall, line, cover):
                                continue
                            for side in range(2):
                                way = 1.0 - 2.0 * side
                                v = wall.after if side == 0 else wall.before
                                short = cover.high < line.half if side == 0 else cover.low > -line.half
                                if v < 0 or not short:
                                    continue
                                begin_way(cover, way)
                                while v >= 0 and cover.reach < line.half and to_follow > 0:
                                    to_follow -= 1
                                    if not follow(walls[v], wall, line, way, cover):
                                        break
                                    v = walls[v].after if side == 0 else walls[v].before
                                end_way(cover)
                            if cover.counted >= gates.least_overlap * 2.0 * line.half:
                                misfit = misfit_of(line, cover)
                                if misfit < least_misfit:
                                    least_misfit = misfit
                                    match.wall = w
                                    write_match(match, scan[i], line, wall, cover, gates.least_overlap)
                gain += match.gain
                if gain + left < threshold:
                    break
            if gain < threshold:
                possible = False
                break
            if rounds == 0:
                refined += 1
            # Change the pairs that are held to those that match.
            changed = False
            for i in range(n):
                w = found[i].wall
                h = held[i].wall
                if w != h or (w >= 0 and abs(found[i].shift - held[i].shift) > SAME_SHIFT):
                    changed = True
                    if h >= 0:
                        change_pair(plain, angles, wall_sums[h], walls[h], scan[i], held[i], -1.0)
                        if wall_sums[h].count <= 0.0:
                            scale_wall(wall_sums[h], 0.0)
                    held[i].wall = w
                    if w >= 0:
                        held[i].shift = found[i].shift
                        held[i].weight = scan[i].weight
                        change_pair(plain, angles, wall_sums[w], walls[w], scan[i], held[i], 1.0)
            if not changed or last:
                break
            if plain.count == 0.0:
                possible = False
                break
            count = list_walls(held, wall_sums, ties, listed)
            eliminate(wall_sums, ties, listed, count, model.wall_variance, plain, sums, common)
            moved = solve_pose(sums, angles, parallel[int(plain.count)], pose, solution)
            rounds += 1
            last = rounds == ROUNDS or not moved
        if possible and plain.count > 0.0:
            # Score each match by what the set would lose without it; drop those without.
            c = math.cos(pose.theta)
            s = math.sin(pose.theta)
            count = list_walls(held, wall_sums, ties, listed)
            infer(wall_sums, ties, listed, count, model.wall_variance, pose)
            gain = 0.0
            for i in range(n):
                match = found[i]
                match.score = 0.0
                w = match.wall
                if w < 0:
                    continue
                own = wall_sums[w]
                weight = scan[i].weight
                px = c * scan[i].centroid_x - s * scan[i].centroid_y + pose.x
                py = s * scan[i].centroid_x + c * scan[i].centroid_y + pose.y
                off = walls[w].dx * py - walls[w].dy * px - walls[w].offset - match.shift
                cost = weight * (off * off + scan[i].spread * match.sine * match.sine)
                known = own.weight + own.other_weight
                of_all = residual_of_wall(own, c, s, pose) + own.other_sum
                cost -= of_all * of_all / known
                of_all -= weight * off
                cost += of_all * of_all / (known - weight)
                match.score = max(0.0, match.gain - 0.5 * cost)
                if match.score > 0.0:
                    gain += match.gain
                else:
                    match.wall = -1
                    change_pair(plain, angles, own, walls[w], scan[i], held[i], -1.0)
                    if own.count <= 0.0:
                        scale_wall(own, 0.0)
                    held[i].wall = -1
                    changed = True
            if plain.count > 0.0 and gain > 0.0 and gain >= floor:
                if changed:
                    count = list_walls(held, wall_sums, ties, listed)
                    eliminate(wall_sums, ties, listed, count, model.wall_variance, plain, sums, common)
                    solve_pose(sums, angles, parallel[int(plain.count)], pose, solution)
                freedom = log_determinant(solution, model)
                out.gain = gain
                out.chi_square = solution.chi_square
                out.log_determinant = freedom
                out.parallel = solution.parallel
                out.score = max(0.0, gain - 0.5 * solution.chi_square - freedom)
                copy_sums(sums, out.sums)
        for i in range(n):
            if held[i].wall >= 0:
                scale_wall(wall_sums[held[i].wall], 0.0)
                wall_sums[held[i].wall].count = 0.0
        if out.score > 0.0:
            bonus = prior_value(prior, pose)
            if prior.kind == HARD_PRIOR:
                # A search within the window stores nothing outside; a ranking lists that, too.
                if rule.within and bonus < INSIDE:
                    out.score = 0.0
                out.inside = bonus >= INSIDE
                bonus = 0.0
            else:
                out.inside = 1
            out.value = out.score + bonus
            if out.score < least - bonus:
                out.score = 0.0
            elif out.score > 0.0:
                best_value = max(best_value, out.value)
    return best_value, refined


@kernel
def list_walls(held: Records, wall_sums: Records, ties: Floats, listed: Floats) -> int:
    """List the walls that are held, each once: those that are tied to none, then the others along their chains."""
    count = 0
    for i in range(len(held)):
        w = held[i].wall
        if w >= 0 and wall_sums[w].listed == 0:
            wall_sums[w].listed = 1
            listed[count] = w
            count += 1
    gap = 1
    while 3 * gap + 1 < count:
        gap = 3 * gap + 1
    while gap > 0:
        for k in range(gap, count):
            w = listed[k]
            j = k
            while j >= gap and ties[listed[j - gap]] > ties[w]:
                listed[j] = listed[j - gap]
                j -= gap
            listed[j] = w
        gap //= 3
    for k in range(count):
        wall_sums[listed[k]].listed = 0
    return count


@kernel
def eliminate(
    wall_sums: Records, ties: Floats, listed: Floats, count: int, variance: float, plain: Record, sums: Record,
    common: Record,
) -> None:  # fmt: skip
    """Write sums without the errors of the listed walls.

    The error of a wall has that variance; those of tied walls correlate by ``exp(-distance)`` along their chain, so
    that each passes on, as a filter does, what the walls before it show.
    """
    copy_sums(plain, sums)
    if variance <= 0.0:
        return
    for k in range(count):
        own = wall_sums[listed[k]]
        tie = ties[listed[k]]
        if tie < 0.0:
            subtract_square(sums, own, 1.0 / (own.weight + 1.0 / variance))
            continue
        before = ties[listed[k - 1]] if k > 0 else -1.0
        if before < 0.0:
            scale_wall(common, 0.0)
            common.weight = 1.0 / variance
        else:
            r = math.exp(before - tie)
            free = variance * (1.0 - r * r)
            left = 1.0 / (common.weight * free + r * r)
            subtract_square(sums, common, free * left)
            weight = common.weight * left
            scale_wall(common, r * left)
            common.weight = weight
        add_wall(common, own)
        if k + 1 == count:
            subtract_square(sums, common, 1.0 / common.weight)


@kernel
def infer(wall_sums: Records, ties: Floats, listed: Floats, count: int, variance: float, pose: Record) -> None:
    """Write for each listed wall the evidence of its error by other walls, at a pose; by itself, the prior's."""
    c = math.cos(pose.theta)
    s = math.sin(pose.theta)
    weight = 1.0 / variance
    total = 0.0
    for k in range(count):
        own = wall_sums[listed[k]]
        tie = ties[listed[k]]
        before = ties[listed[k - 1]] if k > 0 else -1.0
        if before >= 0.0:
            # From those before it.
            r = math.exp(before - tie)
            left = 1.0 / (weight * variance * (1.0 - r * r) + r * r)
            weight *= left
            total *= r * left
        else:
            weight = 1.0 / variance
            total = 0.0
        own.other_weight = weight
        own.other_sum = total
        weight += own.weight
        total += residual_of_wall(own, c, s, pose)
    weight = 0.0
    total = 0.0
    for k in range(count - 2, -1, -1):
        tie = ties[listed[k]]
        if tie < 0.0:
            break
        # From those behind it.
        after = wall_sums[listed[k + 1]]
        weight += after.weight
        total += residual_of_wall(after, c, s, pose)
        r = math.exp(tie - ties[listed[k + 1]])
        left = 1.0 / (weight * variance * (1.0 - r * r) + 1.0)
        weight *= r * r * left
        total *= r * left
        wall_sums[listed[k]].other_weight += weight
        wall_sums[listed[k]].other_sum += total
