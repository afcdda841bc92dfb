"""Compiled choice of bases: the cheap and telling ones first, and when enough have been gone through."""

import math

import numpy as np

from registration.compiling import kernel

from ._search_kernels import MIN_CROSSING_BASE, least_length, search_base

TELLING = 0.25  # m; how far a base may lay the other segments off, root mean square
UNTELLING = 0.1  # what a base is worth less that lays them farther off
REUSE = 0.3  # what a base is worth less for each earlier use of one of its segments

# Measured costs, nanoseconds: of a base, a wall that it may slide on, a metre of slide, a hypothesis.
COST_BASE = 2000.0
COST_ANCHOR = 60.0
COST_SLIDE = 3.0
COST_HYPOTHESIS = 480.0
# Observed over expected number of hypotheses: short walls stand beside long ones, at corners and doors, so that a base
# with a short segment fits more often than lengths alone say, and one across at a small angle less often.
HYPOTHESIS_SCALE = 2.0
SHORT_POWER = -0.7  # of the length of the shorter segment, metres
SHORT_LENGTH = 0.1
SINE_POWER = 0.3
GAIN_POWER = 3.0  # of the lesser gain: long segments are clutter less often


@kernel
def slack_tables(scan, count, bin_starts, longest, summed):
    """Sum over the walls of each direction bin how far scan segment i could slide on them.

    `longest` (m,): lengths of the walls; `summed` (m + 1,): their running sum. Returns
    slides (count, bins) in metres and the number of walls long enough for each segment.
    """
    bins = len(bin_starts) - 1
    slides = np.zeros((count, bins))
    fitting = np.zeros(count)
    for i in range(count):
        need = least_length(scan[i, 4])
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
def is_telling(scan, a, b):
    """Tell whether the pose that a base gives is good enough to find the rest of its consensus set.

    Short segments know little of their angle; a base of two of them lays the others beyond what the gates reach.
    """
    variance = scan[a, 10] * scan[b, 10] / (scan[a, 10] + scan[b, 10])
    x = 0.5 * (scan[a, 2] + scan[b, 2])
    y = 0.5 * (scan[a, 3] + scan[b, 3])
    total = 0.0
    gain = 0.0
    for i in range(len(scan)):
        total += scan[i, 12] * ((scan[i, 2] - x) ** 2 + (scan[i, 3] - y) ** 2)
        gain += scan[i, 12]
    return variance * total <= TELLING**2 * gain


@kernel
def plan_bases(scan, count, bin_starts, longest, summed, area):
    """List the non-parallel pairs of the first `count` scan segments with their logarithmic merit.

    The merit is what the base can tell (the lesser gain) over what it will cost. Returns pairs (k, 2), the one that
    slides first, and merits (k,).
    """
    slides, fitting = slack_tables(scan, count, bin_starts, longest, summed)
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
        short[i] = (scan[i, 4] + SHORT_LENGTH) ** SHORT_POWER
        for b in range(bins):
            total[i] += slides[i, b]
            smooth[i, b] = slides[i, b - 1] + slides[i, b] + slides[i, (b + 1) % bins]
    pairs = np.empty((count * (count - 1) // 2, 2), dtype=np.int64)
    merits = np.empty(len(pairs))
    k = 0
    for i in range(count):
        for j in range(i + 1, count):
            turn = scan[j, 5] - scan[i, 5]
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
            pairs[k, 0] = i if sweep_i <= sweep_j else j
            pairs[k, 1] = j if sweep_i <= sweep_j else i
            merits[k] = GAIN_POWER * math.log(min(scan[i, 12], scan[j, 12])) - math.log(cost)
            if not is_telling(scan, i, j):
                merits[k] += math.log(UNTELLING)
            k += 1
    return pairs[:k], merits[:k]


@kernel
def next_base(pairs, merits, uses):
    """Take the best base that is left, worth less the more its segments were used; -1 when none is left.

    Ties go to the pair that comes first, that of the longest segments.
    """
    best = -1
    best_merit = -math.inf
    fade = math.log(REUSE)
    for k in range(len(pairs)):
        if merits[k] == -math.inf:
            continue
        merit = merits[k] + fade * (uses[pairs[k, 0]] + uses[pairs[k, 1]])
        if merit > best_merit:
            best_merit = merit
            best = k
    if best >= 0:
        merits[best] = -math.inf
        uses[pairs[best, 0]] += 1
        uses[pairs[best, 1]] += 1
    return best


@kernel
def cover(residual, bound, a, b):
    """Lower the bound on what a pose can score whose consensus set contains none of the bases so far.

    Such a pose lacks one segment of each base. The greedy packing of the gains over the bases is a feasible solution of
    the dual of that covering problem, so the bound holds. `residual` (n,) is what is left of each gain.
    """
    less = min(residual[a], residual[b])
    residual[a] -= less
    residual[b] -= less
    bound[0] -= less


@kernel
def strike(missing, inliers, a, b, fewest):
    """Take a base off the sampled consensus sets that have missed all bases so far.

    ``inliers[m, i]`` says for 64 samples a word whether segment i is in a set of m + 1 segments, ``missing[m]`` which
    samples are left; sets of less than `fewest` segments are left alone. Returns the share left of those of `fewest`.
    """
    ones = 0
    for m in range(fewest - 1, len(missing)):
        for k in range(missing.shape[1]):
            missing[m, k] = missing[m, k] & ~(inliers[m, a, k] & inliers[m, b, k])
    for k in range(missing.shape[1]):
        # Population count of 64 bits.
        word = missing[fewest - 1, k]
        word = word - ((word >> np.uint64(1)) & np.uint64(0x5555555555555555))
        word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
        word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
        ones += int((word * np.uint64(0x0101010101010101)) >> np.uint64(56))
    return ones / (64.0 * missing.shape[1])


@kernel
def fewest_segments(best_gains, beyond, needed):
    """Return how many of the first segments a consensus set has at least that scores `needed`.

    `best_gains` (n,): their gains, the largest first; `beyond`: what all other segments of the scan could add.
    """
    total = beyond
    for m in range(len(best_gains)):
        if total >= needed:
            return max(m, 2)
        total += best_gains[m]
    return max(len(best_gains), 2)


# Why `advance` came back.
BUDGET, EXHAUSTED, PROVEN, CONFIDENT = range(4)


@kernel
def advance(
    scan, runs, bin_starts, walls, starts, items, shape, raster_shape, bits, sector_starts, sector_items, sector_shape,
    gates, rules, prior, found, count, best, progress, resume, pairs, merits, uses, residual, bound, best_gains,
    missing, inliers, miss, exhaustive, budget,
):  # fmt: skip
    """Go through bases, the best first, until nothing better can have been missed or `budget` tests are used up.

    ``progress[4]`` is the base under way or -1. ``miss[0]`` is the chance of having missed a better consensus set, kept
    up to date, ``miss[1]`` the greatest one allowed. Returns one of `BUDGET`, `EXHAUSTED`, `PROVEN`, `CONFIDENT`.
    """
    beyond = 0.0
    for i in range(len(best_gains), len(scan)):
        beyond += scan[i, 12]
    spent = 0
    while True:
        if progress[4] < 0:
            progress[4] = next_base(pairs, merits, uses)
            if progress[4] < 0:
                return EXHAUSTED
        a = pairs[progress[4], 0]
        b = pairs[progress[4], 1]
        spent += search_base(
            scan, a, b, runs, bin_starts, walls, starts, items, shape, raster_shape, bits, sector_starts, sector_items,
            sector_shape, gates, rules, prior, found, count, best, progress, resume, budget - spent,
        )  # fmt: skip
        if progress[1] > 0 or resume[0] > -math.inf:
            return BUDGET
        progress[4] = -1
        needed = rules[3] * best[0]
        if is_telling(scan, a, b):
            cover(residual, bound, a, b)
            miss[0] = strike(missing, inliers, a, b, fewest_segments(best_gains, beyond, needed))
        if not exhaustive:
            if bound[0] < needed:
                return PROVEN
            if miss[0] <= miss[1]:
                return CONFIDENT
        if spent > budget:
            return BUDGET
