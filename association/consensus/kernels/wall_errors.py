"""The walls' own errors, taken out of the sums of a consensus set.

Pieces of one wall share the wall's own error. Let ``v = sum w phi`` and ``s = sum w`` over the pairs of a wall, and V
its variance: the wall's part in the sums is ``sum w phi phi' - v v' / (s + 1 / V)``. The errors of walls that continue
one another are correlated, the less the farther apart they are. These are taken out of a copy of the sums before it is
solved.
"""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record

from ...layout import Integers
from ...scan.kernels.ordering import ascending
from ...tables import Workspace
from ..tuning import SORTED_BY_INSERTION
from .pair_sums import clear_wall, copy_sums


@kernel
def eliminate_wall_errors(work: Workspace, ties: Floats, wall_variance: float) -> None:
    """Write the sums of `work` without the errors of its walls.

    The errors of walls along a chain are a Markov process, with the variance V and the correlation r of two that follow
    one another. They are eliminated one after the other. Let l be the weight and b the sum of an error, of which the
    cost is ``l e^2 - 2 e b'x``, and ``q = V (1 - r^2)``. The weight and sum of the next one are ``l / (l q + r^2)`` and
    ``r b / (l q + r^2)``, and ``(b'x)^2 q / (l q + r^2)`` is taken out; of the last one ``(b'x)^2 / l``.
    """
    scratch = work.scratch[0]
    sums = scratch.sums
    wall_sums = work.wall_sums
    copy_sums(scratch.plain, sums)
    if wall_variance <= 0.0:
        return
    alone, count = list_walls(work, ties)
    listed = work.listed
    for k in range(alone):
        own_sums = wall_sums[listed[k]]
        subtract_square(sums, own_sums, 1.0 / (own_sums.weight + 1.0 / wall_variance))
    common = scratch.common
    for k in range(alone, count):
        own_sums = wall_sums[listed[k]]
        if k == alone:
            clear_wall(common)
            common.weight = 1.0 / wall_variance
            pass_error_on(common, own_sums, 0.0)
        else:
            r = math.exp(ties[listed[k - 1]] - ties[listed[k]])
            free = wall_variance * (1.0 - r * r)
            left = 1.0 / (common.weight * free + r * r)
            subtract_square(sums, common, free * left)
            common.weight *= left
            pass_error_on(common, own_sums, r * left)
    if count > alone:
        subtract_square(sums, common, 1.0 / common.weight)


@kernel
def list_walls(work: Workspace, ties: Floats) -> tuple[int, int]:
    """List the walls that are held, each once: first those that are tied to none, then the others along their chains.

    Returns how many these and all are, in ``listed`` of `work`; ties by the order of the scan's lines.
    """
    held = work.held
    wall_sums = work.wall_sums
    listed = work.listed
    alone = 0
    tied = len(held)
    for i in range(len(held)):
        w = held[i]
        if w < 0 or wall_sums[w].listed:
            continue
        wall_sums[w].listed = 1
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
        wall_sums[listed[k]].listed = 0
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
def subtract_square(sums: Record, own_sums: Record, k: float) -> None:
    """Take the square of a wall's sums, times k, out of the sums."""
    sums.cc -= k * own_sums.c * own_sums.c
    sums.cs -= k * own_sums.c * own_sums.s
    sums.cx -= k * own_sums.c * own_sums.x
    sums.cy -= k * own_sums.c * own_sums.y
    sums.c1 -= k * own_sums.c * own_sums.one
    sums.ss -= k * own_sums.s * own_sums.s
    sums.sx -= k * own_sums.s * own_sums.x
    sums.sy -= k * own_sums.s * own_sums.y
    sums.s1 -= k * own_sums.s * own_sums.one
    sums.xx -= k * own_sums.x * own_sums.x
    sums.xy -= k * own_sums.x * own_sums.y
    sums.x1 -= k * own_sums.x * own_sums.one
    sums.yy -= k * own_sums.y * own_sums.y
    sums.y1 -= k * own_sums.y * own_sums.one
    sums.one -= k * own_sums.one * own_sums.one


@kernel
def pass_error_on(common: Record, own_sums: Record, factor: float) -> None:
    """Set the evidence of an error to `factor` times that of the one before, and add a wall's sums."""
    common.c = factor * common.c + own_sums.c
    common.s = factor * common.s + own_sums.s
    common.x = factor * common.x + own_sums.x
    common.y = factor * common.y + own_sums.y
    common.one = factor * common.one + own_sums.one
    common.weight += own_sums.weight


@kernel
def infer_wall_errors(work: Workspace, ties: Floats, wall_variance: float, estimate: Record) -> None:
    """Write for each wall that is held the evidence of its error by other walls, at a pose."""
    wall_sums = work.wall_sums
    listed = work.listed
    alone, count = list_walls(work, ties)
    c = math.cos(estimate.theta)
    s = math.sin(estimate.theta)
    weight = 1.0 / wall_variance
    total = 0.0
    for k in range(count):
        own_sums = wall_sums[listed[k]]
        if k > alone:
            # From those before it.
            r = math.exp(ties[listed[k - 1]] - ties[listed[k]])
            left = 1.0 / (weight * wall_variance * (1.0 - r * r) + r * r)
            weight *= left
            total *= r * left
        else:
            weight = 1.0 / wall_variance
            total = 0.0
        own_sums.other_weight = weight
        own_sums.other_sum = total
        weight += own_sums.weight
        total += residual_of_wall(own_sums, c, s, estimate)
    weight = 0.0
    total = 0.0
    for k in range(count - 2, alone - 1, -1):
        # From those behind it.
        after = wall_sums[listed[k + 1]]
        weight += after.weight
        total += residual_of_wall(after, c, s, estimate)
        r = math.exp(ties[listed[k]] - ties[listed[k + 1]])
        left = 1.0 / (weight * wall_variance * (1.0 - r * r) + 1.0)
        weight *= r * r * left
        total *= r * left
        wall_sums[listed[k]].other_weight += weight
        wall_sums[listed[k]].other_sum += total


@kernel
def residual_of_wall(own_sums: Record, c: float, s: float, estimate: Record) -> float:
    """Return how far the pairs of a wall are off it, times their weights, 1/m, at a pose of cosine c and sine s."""
    return own_sums.c * c + own_sums.s * s + own_sums.x * estimate.x + own_sums.y * estimate.y + own_sums.one
