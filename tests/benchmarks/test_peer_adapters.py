"""Each peer that is installed finds an easy scan, in a process of its own; one that never ends is ended."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from benchmarks.peers.adapters import PEERS, Answer
from benchmarks.peers.corners import CornerOptions, MapCorners, best_of, fit_points, match
from benchmarks.peers.race import Attempt, Racer, attempts, is_right
from benchmarks.peers.report import judged
from benchmarks.peers.scenes import Cell, Level, draw_query, polygons
from registration import RigidTransform

EASY = Level("easy", (24, 24), 0.0, 1e-4, None)


@pytest.fixture(scope="module")
def easy() -> Cell:
    """Scans of free-standing polygons without clutter and noise worth the name."""
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


@pytest.mark.long
def test_corners_fit_where_they_are_and_not_where_a_segment_would_stick_out() -> None:
    room = np.array([[0.0, 0, 4, 0], [4, 0, 4, 3], [4, 3, 0, 3], [0, 3, 0, 0]])
    known = MapCorners.of(room, CornerOptions(known_reach=0.1))
    assert len(known.corners) == 4
    pose = RigidTransform(1.0, 2.0, 0.4)
    scan = pose.inverse().apply(room[:2].reshape(-1, 2)).reshape(-1, 4)
    (found,) = match(scan, known, CornerOptions(headings=0))
    # The long wall first, then the short one: two of the four corners of a rectangle.
    assert len(found) == 2
    assert any(np.allclose(row[:2], [4.0, 0.0]) for row in found.known)
    for stretched in ([[-1.0, 0, 4, 0], [4, 0, 4, 3]], [[0, 0, 4.3, 0], [4, 0, 4, 3]], [[0, 0, 4, 0], [4, -0.3, 4, 3]],
                      [[0, 0, 4, 0], [4, 0, 4, 4.5]]):  # fmt: skip
        (found,) = match(np.array(stretched), known, CornerOptions(headings=0))
        assert len(found) == 0, stretched


def test_points_give_their_pose_back_and_the_better_pose_is_chosen() -> None:
    rng = np.random.default_rng(2)
    pose = RigidTransform(3.0, -1.0, 2.5)
    points = rng.uniform(-5, 5, (6, 2))
    assert fit_points(points, pose.apply(points)) == pytest.approx((3.0, -1.0, 2.5))
    walls = np.array([[0.0, 0, 5, 0], [5, 0, 5, 4]])
    scan = pose.inverse().apply(walls.reshape(-1, 2)).reshape(-1, 4)
    truth = (pose.x, pose.y, pose.theta)
    assert best_of([(0.0, 0.0, 0.0), truth, (3.0, 1.0, 2.5)], scan, walls) == truth


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
