"""Compiled choice of bases: the cheap and telling ones first."""

import math

import numpy as np

from registration.compiling import inlined, kernel
from registration.layout import Floats, Record, Records

from ..layout import BASE, Integers
from ..tables import Plan, Question, Samples, Walls
from ..tuning import (
    BASE_SEGMENTS,
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
from .ordering import ascending
from .sweeping import least_length


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


@inlined
def is_telling(a: Record, b: Record, middle: tuple[float, float, float]) -> bool:
    """Tell whether the pose that a base gives is good enough to find the rest of its consensus set.

    Short segments know little of their angle; a base of two of them lays the others beyond what the gates reach.
    `middle` is that of the scan.
    """
    variance = a.angle_variance * b.angle_variance / (a.angle_variance + b.angle_variance)
    x, y, square = middle
    square += (0.5 * (a.x + b.x) - x) ** 2 + (0.5 * (a.y + b.y) - y) ** 2
    return variance * square <= TELLING**2


@kernel
def plan_bases(scan: Records, count: int, runs: Walls, area: float) -> Records:
    """List the non-parallel pairs of the first `count` scan segments, (k,) of `BASE`.

    Beyond the first `BASE_SEGMENTS` only those that tell enough. The merit is what the base can tell (the lesser
    gain) over what it will cost. `area` is that of the map, m^2.
    """
    slides, fitting = slack_tables(scan, count, runs)
    middle = middle_of(scan)
    bins = slides.shape[1]
    total = np.zeros(count)
    # Twice around, so that a bin that is turned needs no division to be found.
    smooth = np.empty((count, 2 * bins))
    taken = np.empty((count, bins), dtype=np.int64)
    n_taken = np.zeros(count, dtype=np.int64)
    short = np.empty(count)
    tells = np.empty(count)
    for i in range(count):
        tells[i] = math.log(scan[i].gain)
        short[i] = (scan[i].length + SHORT_LENGTH) ** SHORT_POWER
        for b in range(bins):
            after = b + 1 if b + 1 < bins else 0
            smooth[i, b] = slides[i, b - 1] + slides[i, b] + slides[i, after]
            smooth[i, b + bins] = smooth[i, b]
            if slides[i, b] > 0.0:
                total[i] += slides[i, b]
                taken[i, n_taken[i]] = b
                n_taken[i] += 1
    bases = np.empty(count * (count - 1) // 2, dtype=BASE)
    k = 0
    for i in range(count):
        for j in range(i + 1, count):
            turn = scan[j].angle - scan[i].angle
            sine = abs(math.sin(turn))
            telling = is_telling(scan[i], scan[j], middle)
            if sine < MIN_CROSSING_BASE or (j >= BASE_SEGMENTS and not telling):
                continue
            sweep_i = COST_ANCHOR * fitting[i] + COST_SLIDE * total[i]
            sweep_j = COST_ANCHOR * fitting[j] + COST_SLIDE * total[j]
            shift = round(turn / (2.0 * math.pi / bins)) % bins
            expected = 0.0
            for t in range(n_taken[i]):
                b = taken[i, t]
                expected += slides[i, b] * smooth[j, b + shift]
            expected *= HYPOTHESIS_SCALE / area * sine**SINE_POWER * max(short[i], short[j])
            cost = COST_BASE + min(sweep_i, sweep_j) + COST_HYPOTHESIS * expected
            bases[k].sliding = i if sweep_i <= sweep_j else j
            bases[k].crossing = j if sweep_i <= sweep_j else i
            merit = GAIN_POWER * min(tells[i], tells[j]) - math.log(cost)
            if not telling:
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
def begin(
    question: Question,
    runs: Walls,
    area: float,
    orders: Integers,
    ranks: Integers,
    progress: Records,
    fade: float,
    random: bool,
) -> Plan:
    """Plan a search, and put `progress` (1,) at its beginning, at the best value that is known.

    `orders` (samples, n) and `ranks` (n, samples) are those of `Samples`, n being how many segments bases are made of;
    `area` is that of the map, m^2; `fade` and `random` as in `Plan`.
    """
    scan = question.scan
    count, n = orders.shape
    state = progress[0]
    state.current = -1
    state.bound = 0.0
    state.missed = 1.0
    residual = np.empty(len(scan))
    freedoms = np.empty(len(scan))
    losses = np.empty(n)
    for i in range(n):
        losses[i] = -scan[i].gain
    for i in range(len(scan)):
        residual[i] = scan[i].gain
        freedoms[i] = -scan[i].freedom
        state.bound += scan[i].gain
    # All of these have sets that may have missed all bases.
    found = np.empty(count, dtype=np.uint8)
    undecided = np.empty(count + 1, dtype=np.int32)
    for s in range(count):
        found[s] = n
        undecided[s] = s
    undecided[count] = count
    samples = Samples(orders, ranks, found, np.zeros(count, dtype=np.uint8), np.zeros(count), undecided)
    return Plan(
        plan_bases(scan, n, runs, area),
        np.zeros(n),
        residual,
        residual[ascending(losses)],
        ascending(freedoms),
        samples,
        fade,
        random,
    )
