"""Peers of the comparison: adapters in processes of their own, a matcher for grids. Worlds pin the scenes."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from benchmarks.peers.adapters import PEERS, Answer
from benchmarks.peers.grid_matcher import GridMatcher
from benchmarks.peers.race import Attempt, Racer, attempts, is_right
from benchmarks.peers.report import judged
from benchmarks.peers.scenes import Cell, Level, draw_query, polygons
from registration import RigidTransform

LONG = pytest.mark.long

# --- Adapters ---------------------------------------------------------------------------------------------------------

EASY = Level("easy", (24, 24), 0.0, 1e-4, None)


@pytest.fixture(scope="module")
def easy() -> Cell:
    """Scans of free-standing polygons without clutter, and almost without noise."""
    rng = np.random.default_rng(11)
    segments = polygons(60, rng)
    return Cell("polygons", 60, "easy", tuple(draw_query(segments, EASY, rng) for _ in range(2)))


@pytest.fixture(
    params=["linefix", *(pytest.param(name, marks=pytest.mark.long) for name in PEERS if name != "linefix")]
)
def racer(request: pytest.FixtureRequest) -> Iterator[Racer]:
    if not PEERS[request.param].installed:
        pytest.skip(f"{PEERS[request.param].module} is not installed")
    made = Racer(request.param, limit=30.0)
    reason = made.missing()
    if reason is not None:
        pytest.skip(reason)
    yield made
    made.close()


def test_a_peer_finds_what_is_easy(racer: Racer, easy: Cell) -> None:
    found = list(attempts(racer, easy, limit=30.0))
    assert [a.right for a in found] == [True, True]
    assert all(0.0 < a.ms < 30_000.0 for a in found)


@pytest.mark.parametrize(
    ("pose", "right"),
    [((1.29, 2.0, 0.5), True), ((1.31, 2.0, 0.5), False), ((1.0, 2.0, 0.5 + math.radians(2.9)), True),
     ((1.0, 2.0, 0.5 + math.radians(3.1)), False), ((math.nan, 2.0, 0.5), False), (None, False),
     ((1.0, 2.0, 0.5 + math.tau), True)],
)  # fmt: skip
def test_an_answer_counts_within_three_decimetres_and_three_degrees(pose, right: bool) -> None:
    assert is_right(Answer(pose), RigidTransform(1.0, 2.0, 0.5)) is right


def test_a_cell_is_judged_by_the_best_peer_and_by_the_fastest_of_those_near() -> None:
    def asked(right: int, ms: float) -> list[Attempt]:
        return [Attempt(k < right, None, ms) for k in range(100)]

    cell = Cell("offices", 50, "hard", ())
    found = {"linefix": [asked(95, 2.0)], "kiss": [asked(94, 3.0)], "opencv": [asked(40, 0.1)]}
    share, time = judged([cell], found, "linefix", list(found))
    assert (share.met, time.met) == (True, True)
    assert time.goal == "<= 3"
    found["opencv"] = [asked(96, 0.1)]
    share, time = judged([cell], found, "linefix", list(found))
    assert (share.met, time.met) == (False, False)


# --- Grids ------------------------------------------------------------------------------------------------------------

RESOLUTION = 0.1
ORIGIN = RigidTransform(-2.0, 5.0, 0.0)


def room() -> tuple[np.ndarray, np.ndarray]:
    """Return the occupied and the free cells of an L-shaped room."""
    free = np.zeros((48, 64), bool)
    free[4:40, 4:56] = True
    free[24:40, 36:56] = False
    occupied = np.zeros_like(free)
    for shift in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        occupied |= np.roll(free, shift, (0, 1)) & ~free
    return occupied, free


def cast(occupied: np.ndarray, x: float, y: float, theta: float) -> tuple[np.ndarray, np.ndarray]:
    """Return angles and ranges of beams that end in the middle of the first occupied cell, from a place in cells."""
    angles = np.linspace(-math.pi, math.pi, 120, endpoint=False)
    reach = np.arange(0.0, 80.0, 0.05)
    rows = (y + reach * np.sin(angles[:, None] + theta)).astype(int).clip(0, occupied.shape[0] - 1)
    columns = (x + reach * np.cos(angles[:, None] + theta)).astype(int).clip(0, occupied.shape[1] - 1)
    return angles, (reach[occupied[rows, columns].argmax(axis=1)] + 0.5) * RESOLUTION


@pytest.mark.parametrize(
    ("x", "y", "theta"),
    [(12.5, 30.5, 0.4), pytest.param(45.5, 10.5, -2.0, marks=LONG), pytest.param(20.5, 8.5, 3.0, marks=LONG)],
)
def test_the_pose_is_found(x: float, y: float, theta: float) -> None:
    occupied, free = room()
    found = GridMatcher(occupied, free, RESOLUTION, ORIGIN).match(*cast(occupied, x, y, theta))
    assert found.pose is not None
    assert math.hypot(found.pose.x - (x * RESOLUTION - 2.0), found.pose.y - (y * RESOLUTION + 5.0)) < 0.15
    assert abs(math.remainder(found.pose.theta - theta, math.tau)) < math.radians(3.0)
    assert found.usable
