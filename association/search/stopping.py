"""When a search may stop: no better consensus set can have been missed, or none is likely to have been."""

from __future__ import annotations

import math
from bisect import bisect_right
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from registration.layout import Floats

from ..context import SearchContext
from ..layout import DRAWING_STATE, Integers, record
from ..tables import Drawing
from .kernels.bases import rank_bases
from .kernels.stopping import draw_bases
from .tuning import BASE_LINES, DRAWN, REUSE, SAMPLE_SEED, SAMPLES, TELLING_LINES


@cache
def _drawn() -> NDArray[np.uint8]:
    """Return random orders of lines, (samples, lines)."""
    keys = np.random.default_rng(SAMPLE_SEED).random((SAMPLES, TELLING_LINES), dtype=np.float32)
    return keys.argsort(axis=1).astype(np.uint8)


@lru_cache(maxsize=64)
def _orders(lines: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return random orders of the first lines, (samples, lines), and the place of each line in them, transposed."""
    drawn = _drawn()
    orders = drawn[drawn < lines].reshape(SAMPLES, lines)
    ranks = np.empty_like(orders)
    np.put_along_axis(ranks, orders, np.arange(lines, dtype=np.uint8)[None], axis=1)
    return orders, np.ascontiguousarray(ranks.T)


class Bases:
    """The bases of a scan, pairs of its lines: drawn the best first until no consensus set is likely to be missed.

    A consensus set is missed only if none of its pairs was drawn. Two arguments show that one of them was:

    - *Bound*: each base that is drawn takes the lesser gain of its lines from both; what is left over bounds the gain
      of a set without any of the bases, since no line can be in two of them.
    - *Samples*: the fraction of random sets with such gains that hold none of the bases.
    """

    def __init__(self, context: SearchContext) -> None:
        scan, index, options = context.lines.rows, context.index, context.options
        m = self._lines = min(len(scan), BASE_LINES if len(scan) <= BASE_LINES else TELLING_LINES)
        gains, order = np.ascontiguousarray(scan["gain"]), np.argsort(-scan["freedom"], kind="stable")
        self._total, self._best_gains = math.fsum(gains.tolist()), np.cumsum(np.sort(gains[:m])[::-1])
        self._freedoms: list[float] = [*scan["freedom"][order].tolist(), 0.0]
        self._taken: list[float] = np.cumsum(gains[order]).tolist()
        merits, telling, costs = np.full((m, m), -math.inf), np.zeros((m, m), np.bool_), np.zeros(m)
        self.number = rank_bases(scan, BASE_LINES, index.chains, index.area, merits, telling, costs)
        self._at_random = options.sampling == "random"
        if self._at_random:
            merits = random_order(merits, options.seed)
        samples = 0 if self._at_random or m < 2 else SAMPLES
        orders, ranks = _orders(m)
        self._drawing = Drawing(
            merits, telling, costs, gains[:m].copy(), gains,
            record(
                DRAWING_STATE,
                bound=self._total,
                beyond=math.fsum(gains[m:].tolist()),
                missed=float(self.number > 0),
                fade=0.0 if self._at_random else math.log(REUSE),
            ),
            orders, ranks, np.full(samples, m, np.uint8), np.zeros(samples, np.uint8), np.zeros(samples),
            np.arange(samples + 1),
        )  # fmt: skip
        self._drawn, self.count = np.empty((DRAWN, 2), np.intp), 0

    @property
    def bound(self) -> float:
        """The most that a set without any of the bases that were drawn gains, nats."""
        return float(self._drawing.state["bound"][0])

    @property
    def missed(self) -> float:
        """The probability of having missed a better set; by how much it exceeds what is allowed need not be known."""
        return float(self._drawing.state["missed"][0])

    def least_freedom(self, needed: float) -> float:
        """Return the least freedom that a consensus set takes whose gains reach `needed`, nats."""
        return self._freedoms[bisect_right(self._taken, self._total - needed)]

    def draw(self, needed: float, allowed: float) -> Integers:
        """Return the next bases, (b, 2): the lines that slide and cross; none where the stopping rule ends it.

        Parameters
        ----------
        needed : float
            The gains, nats, that a set comes to at least which is not to be missed.
        allowed : float
            The probability of having missed one; -1: all bases are drawn.
        """
        hit = 0.0
        if self._at_random:
            # A base that is drawn among all lines hits two inliers with that probability.
            short = needed - float(self._drawing.state["beyond"][0])
            fewest = min(self._lines, max(2, int(np.searchsorted(self._best_gains, short)) + 1))
            hit = min(1.0, fewest * (fewest - 1) / max(1, self._lines * (self._lines - 1)))
        count = draw_bases(self._drawing, needed, hit, allowed, self._drawn)
        self.count += count
        return self._drawn[:count]


def random_order(merits: Floats, seed: int) -> Floats:
    """Return merits with Gumbel noise: the greatest first are draws without replacement with a probability by merit."""
    noise, some = np.zeros_like(merits), np.isfinite(merits)
    noise[some] = np.random.default_rng(seed).gumbel(size=int(some.sum()))
    return np.asarray(merits + noise)
