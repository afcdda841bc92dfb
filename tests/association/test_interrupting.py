"""A search answers the same to the bit, wherever the clock is looked at."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from association import AssociationOptions, AssociationResult, Deadline, HardPrior, Prior, SoftPrior, associate
from association.search import candidates

from .scenes import INSIDE, equal_rooms, index_of, maze, pose, scan_of, seen

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
    return as_json(associate(INDEX, SCANS[scan], prior, AssociationOptions(**options), deadline))


def as_json(found: AssociationResult) -> str:
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


class Looks(Deadline):
    """A deadline that passes at a look, whatever the time."""

    def __init__(self, left: int) -> None:
        super().__init__()
        self.left = left

    @property
    def passed(self) -> bool:
        self.left -= 1
        return self.left < 0


BUILDING, MANY = index_of(equal_rooms(6)), 10**9


@pytest.mark.parametrize("viewpoint", [(0.0, 0.0), None])
def test_whenever_the_deadline_passes_a_complete_answer_is_that_without_one(
    viewpoint: tuple[float, float] | None,
) -> None:
    """Of an answer that claims to be complete, alternatives and the margin were left out where it passed late."""
    sent = scan_of(seen(equal_rooms(6), INSIDE, noise=0.01, cut=0.4, clutter=3)[0], viewpoint=viewpoint)
    options = AssociationOptions(max_alternatives=20)

    def found(deadline: Deadline) -> AssociationResult:
        return associate(BUILDING, sent, None, options, deadline)

    counted = Looks(MANY)
    whole, looks = as_json(found(counted)), MANY - counted.left
    answers = [found(Looks(left)) for left in range(looks + 1)]
    assert not any(one.usable for one in answers if not one.search.complete)
    assert all(as_json(one) == whole for one in answers if one.search.complete)
    assert {one.search.complete for one in answers} == {True, False}
