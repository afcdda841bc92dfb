"""The fraction of a scan that is parallel to walls of the map, at decimetres from them."""

from __future__ import annotations

import numpy as np
import pytest

from association import Scan
from association.rank_and_estimate import estimate_at
from association.verdict.inconsistencies import displaced_walls
from registration import RigidTransform

from ..scenes import INSIDE, ROOM, answer_of, context_of, index_of, scan_of, seen

LENGTHS = np.hypot(ROOM[:, 2] - ROOM[:, 0], ROOM[:, 3] - ROOM[:, 1])
# The two that face each other in the middle of the room, and the one on the left.
MOVED = [0, 4, 7]
OF_THE_MOVED = LENGTHS[MOVED].sum() / LENGTHS.sum()


def with_walls_off(by: float, turned: float = 0.0) -> Scan:
    """Return a scan in which three of eight walls are off to their left, metres, and turned about their middle, rad."""
    walls = ROOM.copy()
    for k in MOVED:
        begin, end = walls[k, :2], walls[k, 2:]
        middle, half = 0.5 * (begin + end), 0.5 * (end - begin)
        middle = middle + by / np.hypot(*half) * np.array([-half[1], half[0]])
        half = np.array(RigidTransform(0.0, 0.0, turned).apply(half))
        walls[k] = [*(middle - half), *(middle + half)]
    return scan_of(seen(walls, INSIDE)[0], viewpoint=(0.0, 0.0))


def fraction(scan: Scan) -> float:
    context = context_of(index_of(ROOM), scan)
    answer = estimate_at(context, INSIDE).answer
    assert answer is not None
    return displaced_walls(context, answer.best)


@pytest.mark.parametrize(
    ("by", "turned", "expected"),
    [
        (0.0, 0.0, 0.0),
        (0.05, 0.0, 0.0),
        (0.2, 0.0, OF_THE_MOVED),
        (0.3, 0.0, OF_THE_MOVED),
        (0.2, 0.15, 0.0),
        (0.6, 0.0, 0.0),
    ],
)
def test_lines_parallel_to_a_wall_one_to_three_decimetres_from_it(by: float, turned: float, expected: float) -> None:
    assert fraction(with_walls_off(by, turned)) == pytest.approx(expected, abs=1e-9)


def test_such_an_answer_is_not_usable_and_says_why() -> None:
    index = index_of(ROOM)
    assert answer_of(index, with_walls_off(0.0)).usable
    answer = answer_of(index, with_walls_off(0.25))
    assert not answer.usable
    (reason,) = (one for one in answer.reasons if one.code == "map_mismatch")
    assert "parallel to walls" in reason.message
