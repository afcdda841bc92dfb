"""Twins of the kernels that choose bases."""

from __future__ import annotations

import itertools
import math

import numpy as np

from association.search.tuning import (
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
    TIMES_BETTER,
    UNTELLING,
)
from association.tables import Walls
from registration.layout import Floats, Record, Records

from .geometry import point
from .proposing import end_slack

Base = tuple[int, int, float]  # sliding, crossing, merit


def slack_tables(scan: Records, count: int, chains: Walls) -> tuple[Floats, Floats]:
    """Look at every chain of every bin."""
    bins = len(chains.bin_starts) - 1
    slides, fitting = np.zeros((count, bins)), np.zeros(count)
    for i in range(count):
        need = scan[i]["length"] - 2.0 * end_slack(scan[i]["length"])
        for b in range(bins):
            lengths = chains.longest[chains.bin_starts[b] : chains.bin_starts[b + 1]]
            enough = lengths[lengths >= need]
            slides[i, b] = (enough - max(0.0, need)).sum()
            fitting[i] += len(enough)
    return slides, fitting


def is_telling(scan: Records, a: int, b: int) -> bool:
    """Tell whether a base lays the others off by `TELLING` at most, root mean square by gain."""
    va, vb = scan[a]["angle_variance"], scan[b]["angle_variance"]
    pin = 0.5 * (point(scan[a]) + point(scan[b]))
    squares = ((point(scan) - pin) ** 2).sum(axis=1) / (1.0 / va + 1.0 / vb)
    return bool(math.sqrt(np.average(squares, weights=scan["gain"])) <= TELLING)


def plan_bases(scan: Records, count: int, chains: Walls, area: float) -> list[Base]:
    """Weigh every pair by what it tells and what it will cost."""
    slides, fitting = slack_tables(scan, count, chains)
    bins = slides.shape[1]
    sweeps = COST_ANCHOR * fitting + COST_SLIDE * slides.sum(axis=1)
    bases = []
    for i in range(count):
        for j in range(i + 1, count):
            turn = scan[j]["angle"] - scan[i]["angle"]
            sine = abs(math.sin(turn))
            if sine < MIN_CROSSING_BASE or (j >= BASE_SEGMENTS and not is_telling(scan, i, j)):
                continue
            shift = round(turn * bins / math.tau)
            # The chains under j have the turned direction, up to a neighbouring bin.
            expected = sum(slides[i] @ np.roll(slides[j], -shift - k) for k in (-1, 0, 1)) / area
            shorter = min(scan[i]["length"], scan[j]["length"]) + SHORT_LENGTH
            expected *= HYPOTHESIS_SCALE * sine**SINE_POWER * shorter**SHORT_POWER
            cost = COST_BASE + min(sweeps[i], sweeps[j]) + COST_HYPOTHESIS * expected
            worth = min(scan[i]["gain"], scan[j]["gain"]) ** GAIN_POWER * (1.0 if is_telling(scan, i, j) else UNTELLING)
            sliding, crossing = (i, j) if sweeps[i] <= sweeps[j] else (j, i)
            bases.append((sliding, crossing, math.log(worth / cost)))
    return bases


def order_of(bases: list[Base], fade: float, at_most: list[float]) -> list[int]:
    """Return the bases in the order in which they are taken: each use of a segment adds `fade` to its others' merit.

    The merit of a base is not computed before its bound is `TIMES_BETTER` that of another base.
    """
    left, uses, order, asked = list(range(len(bases))), dict.fromkeys(range(1000), 0), [], set()
    while left:
        best, most = left[0], -math.inf
        for k in left:
            used = fade * (uses[bases[k][0]] + uses[bases[k][1]])
            if k not in asked and at_most[k] + used > most + math.log(TIMES_BETTER):
                asked.add(k)
            if k in asked and bases[k][2] + used > most:
                best, most = k, bases[k][2] + used
        left.remove(best)
        order.append(best)
        for segment in bases[best][:2]:
            uses[segment] += 1
    return order


def fewest_segments(best_gains: list[float], beyond: float, needed: float) -> int:
    """Return how many of the largest gains, with all beyond, reach what is needed; two at least."""
    enough = [m for m in range(len(best_gains) + 1) if beyond + sum(best_gains[:m]) >= needed]
    return max(2, min(enough, default=len(best_gains)))


def drawn_chance(fewest: int, count: int) -> float:
    """Return of all pairs of segments the share of which both are among the first ones; 1 where there is no pair."""
    pairs = list(itertools.combinations(range(count), 2))
    return sum(b < fewest for _, b in pairs) / len(pairs) if pairs else 1.0


def least_freedom(scan: Records, needed: float) -> float:
    """Return the least freedom that any set takes whose gains come to `needed`, by its freest line alone."""
    sets = [list(s) for m in range(1, len(scan) + 1) for s in itertools.combinations(range(len(scan)), m)]
    enough = [s for s in sets if scan["gain"][s].sum() >= needed]
    return min((float(scan["freedom"][s].max()) for s in enough), default=float(scan["freedom"].max(initial=0.0)))


def least_freedom_sorted(scan: Records, needed: float) -> float:
    """Return the least freedom such that the lines that take no more come to `needed` together: as above, for many."""
    enough = [f for f in scan["freedom"] if scan["gain"][scan["freedom"] <= f].sum() >= needed]
    return 0.0 if needed <= 0.0 else float(min(enough, default=scan["freedom"].max(initial=0.0)))


def missed_share(orders: np.ndarray, gains: np.ndarray, bases: list[Record], needed: float) -> float:
    """Return of the sampled sets the share that holds none of the bases.

    They are the first two and more of each order that reach what is needed, where all of it does.
    """
    missed, pairs = 0, [{int(base["sliding"]), int(base["crossing"])} for base in bases]
    for order in orders.tolist():
        sums = np.cumsum(gains[order])
        if sums[-1] < needed:
            continue
        some = set(order[: max(2, int(np.argmax(sums >= needed)) + 1)])
        missed += not any(pair <= some for pair in pairs)
    return missed / len(orders)
