"""The walls' own errors: which walls a set is on, the sums without their errors, and what others show of each."""

from __future__ import annotations

import math

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import Integers
from .pairs import add_wall, scale_wall, subtract_square


@kernel
def residual_of_wall(own: Record, c: float, s: float, pose: Record) -> float:
    """Return how far the pairs of a wall are off it, times their weights, 1/m, at a pose of cosine c and sine s."""
    return own.c * c + own.s * s + own.x * pose.x + own.y * pose.y + own.one


@kernel
def list_walls(held: Records, wall_sums: Records, ties: Floats, listed: Integers) -> int:
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
def eliminate(wall_sums: Records, ties: Floats, listed: Integers, count: int, variance: float, scratch: Record) -> None:
    """Write the sums of `scratch` without the errors of the listed walls, from its plain ones.

    The error of a wall has that variance; those of tied walls correlate by ``exp(-distance)`` along their chain, so
    that each passes on, as a filter does, what the walls before it show.
    """
    scratch.sums = scratch.plain
    sums = scratch.sums
    common = scratch.common
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
def infer(wall_sums: Records, ties: Floats, listed: Integers, count: int, variance: float, pose: Record) -> None:
    """Write for each listed wall the evidence of its error by other walls, at a pose."""
    c, s = math.cos(pose.theta), math.sin(pose.theta)
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
