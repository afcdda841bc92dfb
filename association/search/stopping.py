"""When a search may stop: no better consensus set can have been missed, or none is likely to have been."""

from __future__ import annotations

import math
from bisect import bisect_right
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from registration.layout import Floats, Records

from ..tables import Samples
from .kernels.stopping import count_missed
from .tuning import SAMPLE_SEED, SAMPLES, TELLING_LINES


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


class StoppingRule:
    """The bases that were searched, and what they say of the sets that were not found.

    A consensus set is missed only if none of its pairs was searched. Two arguments show that none was:

    - *Bound*: each base that is searched takes the lesser gain of its lines from both; what is left over bounds the
      gain of a set without any of the bases, since no line can be in two of them.
    - *Samples*: the fraction of random sets with such gains that hold none of the bases.
    """

    def __init__(self, scan: Records, lines: int, *, drawn: bool) -> None:
        self._gains = np.ascontiguousarray(scan["gain"])
        gains: list[float] = self._gains.tolist()
        self._lines, self._drawn = lines, drawn
        self._left, self.bound = gains[:lines], math.fsum(gains)
        self._total = self.bound
        self._best_gains = np.cumsum(np.sort(self._gains[:lines])[::-1])
        self._beyond = math.fsum(gains[lines:])
        order = np.argsort(-scan["freedom"], kind="stable")
        self._freedoms: list[float] = [*scan["freedom"][order].tolist(), 0.0]
        self._taken: list[float] = np.cumsum(self._gains[order]).tolist()
        self._samples: Samples | None = None
        if lines > 1 and not drawn:
            orders, ranks = _orders(lines)
            found, sizes = np.full(SAMPLES, lines, np.uint8), np.zeros(SAMPLES, np.uint8)
            self._samples = Samples(orders, ranks, found, sizes, np.zeros(SAMPLES), np.arange(SAMPLES + 1))
        self.missed = 1.0 if lines > 1 else 0.0

    def least_freedom(self, needed: float) -> float:
        """Return the least freedom that a consensus set takes whose gains reach `needed`, nats."""
        return self._freedoms[bisect_right(self._taken, self._total - needed)]

    def searched(self, one: int, other: int, needed: float, allowed: float) -> None:
        """Note that a base was searched: estimate the probability of having missed a set that gains `needed`, nats.

        It need not be known by how much that probability exceeds what is `allowed`.
        """
        less = min(self._left[one], self._left[other])
        self._left[one] -= less
        self._left[other] -= less
        self.bound -= less
        short = needed - self._beyond
        if self._samples is not None:
            most = int(allowed * SAMPLES) if allowed >= 0.0 else SAMPLES
            missed = count_missed(self._samples, one, other, self._gains, short, most)
            self.missed = missed / SAMPLES
            return
        # A base that is drawn among all lines hits two inliers with that probability.
        fewest = min(self._lines, max(2, int(np.searchsorted(self._best_gains, short)) + 1))
        self.missed *= 1.0 - min(1.0, fewest * (fewest - 1) / max(1, self._lines * (self._lines - 1)))


def random_order(merits: Floats, seed: int) -> Floats:
    """Return merits with Gumbel noise: the greatest first are draws without replacement with a probability by merit."""
    noise, some = np.zeros_like(merits), np.isfinite(merits)
    noise[some] = np.random.default_rng(seed).gumbel(size=int(some.sum()))
    return np.asarray(merits + noise)
