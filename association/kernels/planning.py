"""Compiled choice of bases: the cheap and telling ones first, and when enough have been gone through."""

import math

import numpy as np

from registration.compiling import borrowed, inlined, kernel
from registration.layout import Floats, Records

from ..layout import BASE, Integers
from ..tables import MapTables, Plan, Question, Samples, Walls, Workspace
from ..tuning import (
    COST_ANCHOR,
    COST_BASE,
    COST_HYPOTHESIS,
    COST_SLIDE,
    GAIN_POWER,
    HYPOTHESIS_SCALE,
    MIN_CROSSING_BASE,
    SHORT_LENGTH,
    SHORT_POWER,
    SINE_POWER,
    TELLING,
    UNTELLING,
)
from .proposing import least_length, search_base


@kernel
def slack_tables(scan: Records, count: int, runs: Walls) -> tuple[Floats, Floats]:
    """Sum over the runs of each direction bin how far scan segment i could slide on them.

    Returns slides (count, bins) in metres and the number of runs long enough for each segment (count,).
    """
    bin_starts = runs.bin_starts
    longest = runs.longest
    summed = runs.summed
    bins = len(bin_starts) - 1
    slides = np.zeros((count, bins))
    fitting = np.zeros(count)
    for i in range(count):
        need = least_length(scan[i].length)
        for b in range(bins):
            low = bin_starts[b]
            high = bin_starts[b + 1]
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
def is_telling(scan: Records, a: int, b: int) -> bool:
    """Tell whether the pose that a base gives is good enough to find the rest of its consensus set.

    Short segments know little of their angle; a base of two of them lays the others beyond what the gates reach.
    """
    va = scan[a].angle_variance
    vb = scan[b].angle_variance
    variance = va * vb / (va + vb)
    x = 0.5 * (scan[a].x + scan[b].x)
    y = 0.5 * (scan[a].y + scan[b].y)
    total = 0.0
    gain = 0.0
    for i in range(len(scan)):
        total += scan[i].gain * ((scan[i].x - x) ** 2 + (scan[i].y - y) ** 2)
        gain += scan[i].gain
    return variance * total <= TELLING**2 * gain


@kernel
def plan_bases(scan: Records, count: int, runs: Walls, area: float) -> Records:
    """List the non-parallel pairs of the first `count` scan segments, (k,) of `BASE`.

    The merit is what the base can tell (the lesser gain) over what it will cost. `area` is that of the map, m^2.
    """
    slides, fitting = slack_tables(scan, count, runs)
    bin_starts = runs.bin_starts
    bins = len(bin_starts) - 1
    total = np.zeros(count)
    smooth = np.empty((count, bins))
    taken = np.empty(bins, dtype=np.int64)
    n_taken = 0
    for b in range(bins):
        if bin_starts[b + 1] > bin_starts[b]:
            taken[n_taken] = b
            n_taken += 1
    short = np.empty(count)
    for i in range(count):
        short[i] = (scan[i].length + SHORT_LENGTH) ** SHORT_POWER
        for b in range(bins):
            total[i] += slides[i, b]
            smooth[i, b] = slides[i, b - 1] + slides[i, b] + slides[i, (b + 1) % bins]
    bases = np.empty(count * (count - 1) // 2, dtype=BASE)
    k = 0
    for i in range(count):
        for j in range(i + 1, count):
            turn = scan[j].angle - scan[i].angle
            sine = abs(math.sin(turn))
            if sine < MIN_CROSSING_BASE:
                continue
            sweep_i = COST_ANCHOR * fitting[i] + COST_SLIDE * total[i]
            sweep_j = COST_ANCHOR * fitting[j] + COST_SLIDE * total[j]
            shift = round(turn / (2.0 * math.pi / bins))
            expected = 0.0
            for t in range(n_taken):
                b = taken[t]
                expected += slides[i, b] * smooth[j, (b + shift) % bins]
            expected *= HYPOTHESIS_SCALE / area * sine**SINE_POWER * max(short[i], short[j])
            cost = COST_BASE + min(sweep_i, sweep_j) + COST_HYPOTHESIS * expected
            bases[k].sliding = i if sweep_i <= sweep_j else j
            bases[k].crossing = j if sweep_i <= sweep_j else i
            merit = GAIN_POWER * math.log(min(scan[i].gain, scan[j].gain)) - math.log(cost)
            if not is_telling(scan, i, j):
                merit += math.log(UNTELLING)
            bases[k].merit = merit
            k += 1
    return bases[:k]


@kernel
def next_base(bases: Records, uses: Floats, fade: float) -> int:
    """Take the best base that is left, worth less the more its segments were used; -1 when none is left.

    Each use adds `fade` to the logarithm of its merit.

    Ties go to the pair that comes first, that of the longest segments.
    """
    best = -1
    best_merit = -math.inf
    for k in range(len(bases)):
        if bases[k].merit == -math.inf:
            continue
        merit = bases[k].merit + fade * (uses[bases[k].sliding] + uses[bases[k].crossing])
        if merit > best_merit:
            best_merit = merit
            best = k
    if best >= 0:
        bases[best].merit = -math.inf
        uses[bases[best].sliding] += 1
        uses[bases[best].crossing] += 1
    return best


@kernel
def cover(residual: Floats, a: int, b: int) -> float:
    """Return by how much a base lowers the bound on what a pose can score that contains none of the bases so far.

    Such a pose lacks one segment of each base. The greedy packing of the gains over the bases is a feasible solution of
    the dual of that covering problem, so the bound holds. `residual` (n,) is what is left of each gain.
    """
    less = min(residual[a], residual[b])
    residual[a] -= less
    residual[b] -= less
    return less


@kernel
def strike(samples: Samples, a: int, b: int) -> None:
    """Note in the sampled consensus sets that a base was gone through."""
    found = samples.found
    first = samples.ranks[a]
    second = samples.ranks[b]
    for s in range(len(found)):
        later = first[s] if first[s] > second[s] else second[s]
        found[s] = later if later < found[s] else found[s]


@kernel
def missed_sets(scan: Records, samples: Samples, fewest: int, needed: float, most: int) -> int:
    """Count the sampled consensus sets that hold none of the bases so far, up to one more than `most`.

    Each is an order of the segments of bases, and has as many of the first as come to gains of `needed`, `fewest` at
    least, which may be more than before, never less. An order whose gains do not come to it has no set. Where a set
    was found to hold a base it is not looked at any more.
    """
    orders = samples.orders
    found = samples.found
    sizes = samples.sizes
    gains = samples.gains
    undecided = samples.undecided
    n = orders.shape[1]
    left = 0
    at = 0
    end = undecided[len(found)]
    while at < end and left <= most:
        s = undecided[at]
        held = found[s] < fewest
        if not held:
            while (gains[s] < needed or sizes[s] < fewest) and sizes[s] < n:
                gains[s] += scan[orders[s, sizes[s]]].gain
                sizes[s] += 1
            held = found[s] < sizes[s] or gains[s] < needed
        if held:
            end -= 1
            undecided[at] = undecided[end]
        else:
            left += 1
            at += 1
    undecided[len(found)] = end
    return left


@kernel
def fewest_segments(best_gains: Floats, beyond: float, needed: float) -> int:
    """Return how many of the first segments a consensus set has at least that scores `needed`.

    `best_gains` (n,): their gains, the largest first; `beyond`: what all other segments of the scan could add.
    """
    total = beyond
    for m in range(len(best_gains)):
        if total >= needed:
            return max(m, 2)
        total += best_gains[m]
    return max(len(best_gains), 2)


@inlined
def drawn_chance(fewest: int, count: int) -> float:
    """Return the chance that both segments of a base drawn among `count` are among `fewest` inliers."""
    return min(1.0, fewest * (fewest - 1) / max(1, count * (count - 1)))


@kernel
def least_freedom(scan: Records, freest: Integers, needed: float) -> float:
    """Return what freedom a consensus set takes at least whose gains come to `needed`, nats.

    It has one of the lines at least without which the others do not come to that; `freest` (n,) are the lines, those
    that take most by themselves first.
    """
    rest = 0.0
    for i in range(len(scan)):
        rest += scan[i].gain
    for i in freest:
        rest -= scan[i].gain
        if rest < needed:
            return scan[i].freedom
    return 0.0


@kernel
def needed_of(question: Question, plan: Plan, best_value: float) -> float:
    """Return what the gains of a set come to at least that scores as high as a rival of the best."""
    needed = question.terms[0].rules.rival_share * best_value
    return needed + least_freedom(question.scan, plan.freest, needed)


@kernel
def gain_beyond(scan: Records, plan: Plan) -> float:
    """Return what the segments of a scan could add of which no bases are made, nats."""
    beyond = 0.0
    for i in range(len(plan.best_gains), len(scan)):
        beyond += scan[i].gain
    return beyond


@kernel
def missed_share(question: Question, plan: Plan, progress: Records) -> float:
    """Return the share of the sampled consensus sets that hold none of the bases so far."""
    scan = question.scan
    needed = needed_of(question, plan, progress[0].best_value)
    beyond = gain_beyond(scan, plan)
    count = len(plan.samples.found)
    fewest = fewest_segments(plan.best_gains, beyond, needed)
    return missed_sets(scan, plan.samples, fewest, needed - beyond, count) / count


# Why `advance` came back.
BUDGET, EXHAUSTED, PROVEN, CONFIDENT = range(4)


@kernel
def advance(
    question: Question,
    tables: MapTables,
    plan: Plan,
    found: Records,
    progress: Records,
    work: Workspace,
    allowed: float,
    budget: int,
) -> int:
    """Go through bases, the best first, until nothing better can have been missed or `budget` tests are used up.

    `allowed` is the greatest chance of having missed a better consensus set, -1 to go through all bases; `progress`
    (1,) keeps that chance up to date, or says that it is greater than that: see `missed_share`. Returns one of
    `BUDGET`, `EXHAUSTED`, `PROVEN`, `CONFIDENT`.
    """
    question = borrowed(question)
    tables = borrowed(tables)
    plan = borrowed(plan)
    found = borrowed(found)
    progress = borrowed(progress)
    work = borrowed(work)
    scan = question.scan
    rules = question.terms[0].rules
    state = progress[0]
    bases = plan.bases
    count = len(plan.samples.found)
    beyond = gain_beyond(scan, plan)
    spent = 0
    while True:
        if state.base < 0:
            state.base = next_base(bases, plan.uses, plan.fade)
            if state.base < 0:
                return EXHAUSTED
        base = bases[state.base]
        spent += search_base(question, tables, base, found, state, work, budget - spent)
        if state.anchor > 0 or state.slide > -math.inf:
            return BUDGET
        state.base = -1
        state.least_freedom = least_freedom(scan, plan.freest, rules.kept_share * state.best_value)
        needed = needed_of(question, plan, state.best_value)
        a = base.sliding
        b = base.crossing
        if is_telling(scan, a, b):
            state.bound -= cover(plan.residual, a, b)
            fewest = fewest_segments(plan.best_gains, beyond, needed)
            if plan.random:
                state.missed *= 1.0 - drawn_chance(fewest, len(plan.best_gains))
            else:
                strike(plan.samples, a, b)
                # It need not be known by how much too many are left.
                most = math.floor(allowed * count) if allowed >= 0.0 else -1
                state.missed = missed_sets(scan, plan.samples, fewest, needed - beyond, most) / count
        if state.best_value >= rules.enough:
            return CONFIDENT
        if allowed >= 0.0:
            if state.bound < needed:
                return PROVEN
            if state.missed <= allowed:
                return CONFIDENT
        if spent > budget:
            return BUDGET
