"""The null: what the scan scores with left and right exchanged, and whether the map makes it do so by right."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings

from association import Beams, HardPrior, Scan
from association.context import SearchContext
from association.explanations import Answer
from association.rank_and_estimate import search_and_rank
from association.scan.scan import mirrored
from association.verdict.chance import NullScore, find_null_score
from association.verdict.tuning import NULL_FRACTION, UNLIKE_SYMMETRY
from association.verdict.verdict import judge
from registration import MeasuredSegments, RigidTransform, Segments
from registration.layout import Floats

from ..answers import report_of
from ..kernels.drawn import SEEDS, drawn
from ..scenes import (
    CORRIDOR,
    INSIDE,
    ROOM,
    SQUARE,
    answer_of,
    beams_of,
    context_of,
    index_of,
    maze,
    pose,
    pose_in,
    same_pose,
    scan_of,
    seen,
)

BOX = np.array([[0, 0, 8, 0], [8, 0, 8, 5], [8, 5, 0, 5], [0, 5, 0, 0]], dtype=float)
FLATS = np.vstack([ROOM, ROOM[:, [2, 3, 0, 1]] * np.array([-1, 1, -1, 1]) - np.array([4, 0, 4, 0])])  # mirrored ones
# The room and the scan of two of its walls that make no sure answer: the corner fits elsewhere when it is mirrored.
LOBBY = np.array([[0, 0, 8, 0], [8, 0, 8, 3], [8, 3, 5, 3], [5, 3, 5, 6], [5, 6, 0, 6], [0, 6, 0, 0]], dtype=float)
CORNER = np.array([[-3, -1, 4.5, -1], [4.5, -1, 4.5, 1.5]])


def measured(seed: int) -> MeasuredSegments:
    """Draw segments with points that lie to one side."""
    d = drawn(seed)
    segments = Segments.from_array(d.endpoints)
    count = len(segments)
    centroids = segments.midpoints + 0.1 * segments.lengths[:, None] * d.rng.uniform(-1.0, 1.0, (count, 1)) * (
        segments.directions
    )
    spreads = segments.lengths**2 * d.rng.uniform(0.02, 0.1, count)
    return MeasuredSegments.from_segments(segments, d.rng.uniform(0.01, 0.05, count), moments=(centroids, spreads))


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_a_scan_that_is_mirrored_twice_is_itself(seed: int) -> None:
    ranges = np.array([1.0, math.inf, math.nan, 4.0])
    beams = Beams(np.array([-0.3, 0.1, 0.2, 0.9]), ranges, 12.0)
    scan = Scan(measured(seed), (0.3, -0.2), beams)
    once, twice = mirrored(scan), mirrored(mirrored(scan))
    assert twice.viewpoint == scan.viewpoint
    assert once.viewpoint == (0.3, 0.2)
    for name in ("sigma", "point_counts", "centroids", "spreads"):
        np.testing.assert_array_equal(getattr(twice.measured, name), getattr(scan.measured, name))
    np.testing.assert_array_equal(twice.measured.segments.endpoints, scan.measured.segments.endpoints)
    assert twice.beams is not None
    assert once.beams is not None
    np.testing.assert_array_equal(twice.beams.angles, beams.angles)
    np.testing.assert_array_equal(twice.beams.ranges, ranges)
    np.testing.assert_array_equal(once.beams.angles, [-0.9, -0.2, -0.1, 0.3])
    np.testing.assert_array_equal(once.beams.ranges, ranges[::-1])
    assert mirrored(replace(scan, viewpoint=None, beams=None)).viewpoint is None


@pytest.mark.parametrize("with_beams", [False, True])
def test_a_mirrored_scan_is_what_is_seen_in_a_mirrored_building(with_beams: bool) -> None:
    """Free space stays on the left of its walls, points where they lay, and the score is the same."""
    index, other = index_of(ROOM), index_of(ROOM[:, [2, 3, 0, 1]] * np.array([1, -1, 1, -1]))
    ends = seen(ROOM, INSIDE, noise=0.02, cut=0.3, clutter=2, seed=3)[0]
    scan = scan_of(ends, viewpoint=(0.0, 0.0), beams=beams_of(index, INSIDE) if with_beams else None)
    here, there = answer_of(index, scan), answer_of(other, mirrored(scan))
    assert same_pose(pose_in(there), RigidTransform(pose_in(here).x, -pose_in(here).y, -pose_in(here).theta), 1e-6)
    assert here.diagnostics is not None
    assert there.diagnostics is not None
    assert there.diagnostics.score == pytest.approx(here.diagnostics.score, rel=1e-6)


def best_of(walls: Floats, ends: Floats, prior: HardPrior | None = None) -> tuple[SearchContext, Answer]:
    context = context_of(index_of(walls), scan_of(ends), prior)
    answer = search_and_rank(context).answer
    assert answer is not None
    return context, answer


@pytest.mark.parametrize(
    ("walls", "at"),
    [(SQUARE, pose(2.0, 1.5, 0.4)), (BOX, pose(3.0, 2.0, 0.4)), (FLATS, INSIDE), (CORRIDOR, pose(14.0, 0.8, 0.05))],
)
def test_where_the_map_is_mirror_symmetric_the_null_scores_by_right(walls: Floats, at: RigidTransform) -> None:
    """As much as the answer does; what the map shows of the place it shows mirrored as well."""
    context, answer = best_of(walls, seen(walls, at, noise=0.01, radius=7.0, seed=1)[0])
    null = find_null_score(context, answer.best)
    assert null.score == pytest.approx(answer.best.score, rel=1e-6)
    assert null.symmetry == pytest.approx(1.0)


def test_where_it_is_not_the_null_scores_by_chance() -> None:
    """Two walls of an L fit elsewhere as well when they are mirrored, the walls that were not seen do not."""
    context, answer = best_of(LOBBY, CORNER)
    null = find_null_score(context, answer.best)
    assert null.score == pytest.approx(answer.best.score, rel=1e-6)
    assert null.symmetry < UNLIKE_SYMMETRY


@pytest.mark.parametrize("walls", [ROOM, maze(1)])
def test_what_comes_nowhere_near_the_answer_is_not_looked_for(walls: Floats) -> None:
    at = INSIDE if len(walls) == len(ROOM) else pose(15.0, 14.0, 0.5)
    context, answer = best_of(walls, seen(walls, at, noise=0.01, radius=8.0)[0])
    assert find_null_score(context, answer.best) == NullScore(0.0, 0.0)


def test_a_null_that_comes_to_less_than_is_asked_about_is_none() -> None:
    """A value at the limit is reported unchanged."""
    context, answer = best_of(LOBBY, CORNER)
    null = find_null_score(context, answer.best)
    share = null.score / answer.best.score
    assert share > NULL_FRACTION
    assert find_null_score(context, answer.best, share - 1e-6) == null
    assert find_null_score(context, answer.best, share + 0.4) == NullScore(0.0, 0.0)


@pytest.mark.parametrize("with_beams", [False, True])
@pytest.mark.parametrize("sampling", ["ordered", "random"])
def test_the_null_is_the_same_each_time_and_leaves_the_search_as_it_was(sampling: str, with_beams: bool) -> None:
    """The same report to the bit; a window around the answer does not hold the null."""
    index = index_of(FLATS)
    scan = scan_of(seen(ROOM, INSIDE, noise=0.02, cut=0.3, clutter=3, seed=1)[0], viewpoint=(0.0, 0.0))
    scan = replace(scan, beams=beams_of(index, INSIDE)) if with_beams else scan

    def told(prior: HardPrior | None, nulls: int) -> tuple[str, list[NullScore]]:
        context = context_of(index, scan, prior, sampling=sampling, seed=3)
        explanations = search_and_rank(context)
        assert explanations.answer is not None
        found = [find_null_score(context, explanations.answer.best) for _ in range(nulls)]
        return repr(report_of(context, explanations, judge(context, explanations))), found

    window = HardPrior(INSIDE, 1.0, 0.5)
    (plain, _), (asked, nulls), (_, within) = told(None, 0), told(None, 3), told(window, 1)
    assert asked == plain
    assert nulls == [nulls[0]] * 3
    assert nulls[0].score > 30.0
    assert within == nulls[:1]
