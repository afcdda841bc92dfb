"""Pairs of requests that differ by 1 mm, or in nothing that matters, are drawn and judged."""

from __future__ import annotations

import numpy as np

from benchmarks.smoothness import CHANGE, KINDS, MOST, answered, draw_pair, rows_of


def test_pairs_differ_as_their_kind_says() -> None:
    for number in range(2 * len(KINDS)):
        kind, (one, other) = draw_pair(number, 3)
        assert kind == KINDS[number % len(KINDS)].__name__
        if kind.endswith(("step", "gap")):
            moved = max(np.abs(other.walls - one.walls).max(), np.abs(other.scan - one.scan).max())
            assert 0.3 * CHANGE < moved < 1.01 * CHANGE


def test_a_few_pairs_are_answered_alike() -> None:
    found = list(answered(8 * len(KINDS), seed=5))
    assert sum(one.difference > MOST for one in found) <= 1
    rows = rows_of(found)
    assert [row.what for row in rows[:2]] == ["map step", "map gap"]
    assert rows[-1].measured.startswith(("0.00 %", "1.14 %"))
