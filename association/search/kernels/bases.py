"""Compiled choice of bases, the minimal samples: those first that cost little and fix the pose well."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import FIGURE, Integers
from ...scan.kernels.ordering import ascending
from ...tables import Crossings, MapTables, Question, Walls
from ..layout import BASE, LINE_COST, LISTED
from ..tables import Costs, Plan, Samples, Sampling
from ..tuning import (
    BASE_SEGMENTS,
    COST_ANCHOR,
    COST_BASE,
    COST_ENTRY,
    COST_HYPOTHESIS,
    COST_SLIDE,
    GAIN_POWER,
    HYPOTHESIS_SCALE,
    MIN_CROSSING_BASE,
    SHORT_LENGTH,
    SHORT_POWER,
    SINE_POWER,
    TELLING,
    TIMES_BETTER,
    UNTELLING,
)
from .lookup import look_up
from .sweeping import least_length, measure


@kernel
def slack_tables(scan: Records, count: int, chains: Walls) -> tuple[Floats, Floats]:
    """Sum over the chains of each direction bin how far scan segment i could slide on them.

    Returns slides (count, bins) in metres and the number of chains long enough for each segment (count,).
    """
    bin_starts = chains.bin_starts
    longest = chains.longest
    summed = chains.summed
    bins = len(bin_starts) - 1
    slides = np.zeros((count, bins), np.float64)
    fitting = np.zeros(count, np.float64)
    for i in range(count):
        need = least_length(scan[i].length)
        for b in range(bins):
            low = bin_starts[b]
            high = bin_starts[b + 1]
            if low == high:
                continue
            while low < high:
                middle = (low + high) // 2
                if longest[middle] >= need:
                    low = middle + 1
                else:
                    high = middle
            fit = low - bin_starts[b]
            slides[i, b] = summed[low] - summed[bin_starts[b]] - fit * max(need, 0.0)
            fitting[i] += fit
    return slides, fitting


@kernel
def middle_of(scan: Records) -> tuple[float, float, float]:
    """Return the mean of the midpoints by their gains, x and y, and the mean square of how far they lie from it."""
    gain = 0.0
    x = 0.0
    y = 0.0
    for i in range(len(scan)):
        gain += scan[i].gain
        x += scan[i].gain * scan[i].x
        y += scan[i].gain * scan[i].y
    if gain <= 0.0:
        return 0.0, 0.0, 0.0
    x /= gain
    y /= gain
    square = 0.0
    for i in range(len(scan)):
        square += scan[i].gain * ((scan[i].x - x) ** 2 + (scan[i].y - y) ** 2)
    return x, y, square / gain


@kernel
def is_telling(a: Record, b: Record, middle: tuple[float, float, float]) -> bool:
    """Return whether the pose that a base gives is precise enough to find the rest of its consensus set.

    The angle of a short segment is imprecise; a base of two of them lays the others beyond the gates. `middle` is that
    of the scan.
    """
    variance = a.angle_variance * b.angle_variance / (a.angle_variance + b.angle_variance)
    x, y, square = middle
    square += (0.5 * (a.x + b.x) - x) ** 2 + (0.5 * (a.y + b.y) - y) ** 2
    return variance * square <= TELLING**2


@kernel
def costs_of(count: int, chains: Walls, area: float, crossings: Crossings) -> Costs:
    """Return the costs of bases of the first `count` scan segments, those of sweeps not yet known.

    `area` is that of the map, m^2; its crossings give the costs of bases that are looked up.
    """
    bins = len(chains.bin_starts) - 1
    return Costs(
        crossings,
        np.empty(1, FIGURE),
        np.empty(0, LISTED),
        chains,
        np.zeros(1, np.uint8),
        np.empty(count, LINE_COST),
        np.empty((count, bins), np.float64),
        np.empty((count, 2 * bins), np.float64),
        np.empty((count, bins), np.int64),
        HYPOTHESIS_SCALE / area,
    )


@kernel
def know_sweeps(scan: Records, costs: Costs) -> None:
    """Write the parts of the costs of sweeps that depend on one segment each, when the first base is swept."""
    costs.known[0] = 1
    lines = costs.lines
    smooth = costs.smooth
    taken = costs.taken
    count, bins = costs.slides.shape
    slides, fitting = slack_tables(scan, count, costs.chains)
    for i in range(count):
        line = lines[i]
        total = 0.0
        line.bins = 0
        for b in range(bins):
            costs.slides[i, b] = slides[i, b]
            after = b + 1 if b + 1 < bins else 0
            smooth[i, b] = slides[i, b - 1] + slides[i, b] + slides[i, after]
            smooth[i, b + bins] = smooth[i, b]
            if slides[i, b] > 0.0:
                total += slides[i, b]
                taken[i, line.bins] = b
                line.bins += 1
        line.angle = scan[i].angle
        line.short = (scan[i].length + SHORT_LENGTH) ** SHORT_POWER
        line.sweep = COST_ANCHOR * fitting[i] + COST_SLIDE * total


@kernel
def pair_up(scan: Records, count: int) -> Records:
    """List the non-parallel pairs of the first `count` scan segments, (k,) of `BASE`, the second left of the first.

    Beyond the first `BASE_SEGMENTS` only those that fix the pose well. None is weighed.
    """
    middle = middle_of(scan)
    tells = np.empty(count, np.float64)
    for i in range(count):
        tells[i] = GAIN_POWER * math.log(scan[i].gain) - math.log(COST_BASE)
    bases = np.empty(count * (count - 1) // 2, BASE)
    k = 0
    for i in range(count):
        for j in range(i + 1, count):
            sine = scan[i].dx * scan[j].dy - scan[i].dy * scan[j].dx
            telling = is_telling(scan[i], scan[j], middle)
            if abs(sine) < MIN_CROSSING_BASE or (j >= BASE_SEGMENTS and not telling):
                continue
            base = bases[k]
            base.sliding = i if sine > 0.0 else j
            base.crossing = j if sine > 0.0 else i
            base.merit = min(tells[i], tells[j]) + (0.0 if telling else math.log(UNTELLING))
            base.weighed = 0
            k += 1
    return bases[:k]


@kernel
def weigh(base: Record, scan: Records, gates: Record, costs: Costs) -> None:
    """Subtract the cost of a base from its merit, once, and choose how it is searched: by lists or by a sweep."""
    figure = costs.figure[0]
    measure(scan[base.sliding], scan[base.crossing], gates, figure)
    _, base.listed = look_up(figure, costs.crossings, costs.no_lists)
    if base.listed >= 0:
        cost = COST_BASE + COST_ENTRY * base.listed
    else:
        if costs.known[0] == 0:
            know_sweeps(scan, costs)
        i = min(base.sliding, base.crossing)
        j = max(base.sliding, base.crossing)
        slides = costs.lines[i].sweep <= costs.lines[j].sweep
        base.sliding = i if slides else j
        base.crossing = j if slides else i
        cost = swept_cost(i, j, costs)
    base.merit -= math.log(cost / COST_BASE)
    base.weighed = 1


@kernel
def swept_cost(i: int, j: int, costs: Costs) -> float:
    """Return the cost of sweeping a base of the scan segments i and j > i."""
    one = costs.lines[i]
    other = costs.lines[j]
    slides = costs.slides[i]
    smooth = costs.smooth[j]
    taken = costs.taken[i]
    bins = len(slides)
    turn = other.angle - one.angle
    shift = round(turn / (2.0 * math.pi / bins)) % bins
    expected = 0.0
    for t in range(one.bins):
        b = taken[t]
        expected += slides[b] * smooth[b + shift]
    expected *= costs.scale * abs(math.sin(turn)) ** SINE_POWER * max(one.short, other.short)
    return COST_BASE + min(one.sweep, other.sweep) + COST_HYPOTHESIS * expected


@kernel
def weigh_all(question: Question, bases: Records, costs: Costs, noise: Floats) -> None:
    """Weigh bases that are drawn at random by their merits, and add noise to these, (k,) or more."""
    for k in range(len(bases)):
        weigh(bases[k], question.scan, question.terms[0].gates, costs)
        bases[k].merit += noise[k]


@kernel
def next_base(question: Question, plan: Plan) -> int:
    """Return the base of the greatest merit that is left, less for each use of its segments; -1 when none is left.

    The merit of a base that is not weighed is an upper limit, so that few need be: a base is weighed only where its
    merit may be `TIMES_BETTER` times that of another. Ties go to the pair that comes first, of the longest segments.
    """
    bases = plan.bases
    uses = plan.uses
    best = -1
    best_merit = -math.inf
    slack = math.log(TIMES_BETTER)
    for k in range(len(bases)):
        base = bases[k]
        used = plan.fade * (uses[base.sliding] + uses[base.crossing])
        if base.merit + used > best_merit + (0.0 if base.weighed else slack):
            if base.weighed == 0:
                weigh(base, question.scan, question.terms[0].gates, plan.costs)
            if base.merit + used > best_merit:
                best_merit = base.merit + used
                best = k
    if best >= 0:
        bases[best].merit = -math.inf
        uses[bases[best].sliding] += 1
        uses[bases[best].crossing] += 1
    return best


@kernel
def plan_search(question: Question, tables: MapTables, sampling: Sampling, statistics: Record) -> Plan:
    """Pair up the bases of a scan and prepare the stopping rule; `statistics` get the bound of nothing searched yet."""
    scan = question.scan
    n = sampling.orders.shape[1]
    random = len(sampling.noise) > 0
    residual = np.empty(len(scan), np.float64)
    freedoms = np.empty(len(scan), np.float64)
    losses = np.empty(n, np.float64)
    for i in range(n):
        losses[i] = -scan[i].gain
    for i in range(len(scan)):
        residual[i] = scan[i].gain
        freedoms[i] = -scan[i].freedom
        statistics.bound += scan[i].gain
    costs = costs_of(n, sampling.chains, sampling.area, tables.crossings)
    bases = pair_up(scan, n)
    if random:
        weigh_all(question, bases, costs, sampling.noise)
    return Plan(
        bases,
        costs,
        np.zeros(n, np.float64),
        residual,
        residual[ascending(losses)],
        ascending(freedoms),
        all_undecided(sampling.orders, sampling.ranks),
        sampling.fade,
        random,
    )


@kernel
def all_undecided(orders: Integers, ranks: Integers) -> Samples:
    """Return sampled consensus sets none of which holds a base that was searched."""
    count, n = orders.shape
    found = np.empty(count, np.uint8)
    undecided = np.empty(count + 1, np.int32)
    for s in range(count):
        found[s] = n
        undecided[s] = s
    undecided[count] = count
    return Samples(orders, ranks, found, np.zeros(count, np.uint8), np.zeros(count, np.float64), undecided)
