"""A search answers the same to the bit, wherever the clock is looked at."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from association import AssociationOptions, Deadline, HardPrior, Prior, SoftPrior, associate
from association.search import candidates

from .scenes import index_of, maze, pose, scan_of, seen

ON_A_GRID = np.round(maze(3, 90, 40.0) * 2.0) / 2.0  # crossings lie where cells meet
ON_A_GRID = ON_A_GRID[np.hypot(*(ON_A_GRID[:, 2:] - ON_A_GRID[:, :2]).T) > 0.4]
INDEX = index_of(ON_A_GRID)
AT = pose(15.0, 14.0, 0.5)
SCANS = [scan_of(seen(ON_A_GRID, AT, noise=0.02, cut=0.4, clutter=clutter, radius=9.0)[0]) for clutter in (2, 12)]
SOFT, HARD = SoftPrior(AT, np.diag([4.0, 4.0, 0.5])), HardPrior(AT, 3.0, 1.0)
QUESTIONS: list[tuple[Prior | None, dict[str, Any]]] = [
    (None, {}),
    (SOFT, {}),
    (HARD, {}),
    (None, {"sampling": "random", "seed": 5}),
    (None, {"exhaustive": True}),
    (None, {"min_overlap": 0.3, "oriented": False}),
]


def answer(number: int, scan: int, deadline: Deadline) -> str:
    prior, options = QUESTIONS[number]
    found = associate(INDEX, SCANS[scan], prior, AssociationOptions(**options), deadline)
    return json.dumps(asdict(found), default=lambda value: value.tolist())


@pytest.mark.parametrize("scan", [0, 1])
@pytest.mark.parametrize("number", range(len(QUESTIONS)))
def test_where_the_clock_is_looked_at_makes_no_difference(
    number: int, scan: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = answer(number, scan, Deadline())
    for chunk in (1, 40, 1000):
        monkeypatch.setattr(candidates, "CHUNK", chunk)
        assert answer(number, scan, Deadline()) == whole
