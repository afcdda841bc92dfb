"""Explanations: which of them is the answer, which are its alternatives, and what is estimated of it."""

from __future__ import annotations

import numpy as np
import pytest

from association import Deadline, HardPrior
from association.consensus.estimation import estimate_poses
from association.consensus.sight import agreement
from association.rank_and_estimate import estimate_at, search_and_rank
from association.verdict.chance import significance

from .answers import ROOM_INDEX, SCAN, answer_with, explanations_of, ranked
from .scenes import INSIDE, ROOM, context_of, equal_rooms, index_of, pose, same_pose, scan_of


def test_alternatives_lie_within_the_window_and_others_anywhere() -> None:
    best, second, third = ranked(90.0), ranked(80.0), ranked(70.0)
    outside = ranked(95.0, inside=False)
    explanations = explanations_of(answer_with(best), third, outside, second)
    assert explanations.ranked == (best, second, third, outside)
    assert list(explanations.alternatives) == [second, third]
    assert list(explanations.others) == [second, third, outside]
    nothing = explanations_of(None, outside)
    assert list(nothing.alternatives) == []
    assert list(nothing.others) == [outside]


def test_the_answer_is_the_best_within_the_window() -> None:
    index = index_of(equal_rooms(2))
    context = context_of(index, SCAN, HardPrior(pose(INSIDE.x + 12.0, INSIDE.y, INSIDE.theta), 0.5, 0.3))
    explanations = search_and_rank(context)
    assert explanations.answer is not None
    assert explanations.answer.best is explanations.ranked[0]
    assert context.in_map(explanations.answer.best.pose).x == pytest.approx(INSIDE.x + 12.0)
    found = explanations.answer.registered.pose
    assert found is not None
    assert same_pose(found, pose(INSIDE.x + 12.0, INSIDE.y, INSIDE.theta), 1e-6, 1e-6)


def test_nothing_within_the_window_is_no_answer() -> None:
    """Poses outside of the prior are reported."""
    explanations = search_and_rank(context_of(ROOM_INDEX, SCAN, HardPrior(pose(-30.0, 0.0), 0.5, 0.3)))
    assert explanations.answer is None
    assert len(explanations.ranked) > 0
    assert not any(one.inside for one in explanations.ranked)


def test_what_is_worked_out_of_the_answer() -> None:
    """Significance is that of the score of the matches alone, not for what lines of sight speak against them."""
    context = context_of(index_of(np.vstack([ROOM, [[4.5, 0.5, 4.5, 3.5]]])), SCAN)
    explanations = search_and_rank(context)
    answer = explanations.answer
    assert answer is not None
    score = float(answer.best.matches["score"].sum())
    assert score > answer.best.score + 3.0
    assert answer.significance == pytest.approx(significance(context, score))
    assert answer.significance < significance(context, answer.best.score)
    assert answer.agreement == agreement(context, answer.best) < 1.0
    estimated, again = estimate_poses(context, [answer.best, answer.best], leverages=True)
    assert same_pose(estimated.pose, answer.estimated.pose, 1e-9, 1e-9)
    assert estimated.weakest == answer.estimated.weakest
    assert (again.pose, len(again.leverages)) == (estimated.pose, 0)
    assert len(estimated.leverages) == len(answer.estimated.leverages) > 4
    found = answer.registered.pose
    assert found is not None
    assert same_pose(found, context.in_map(estimated.pose), 1e-12, 1e-12)
    assert len(answer.accepted.pairs) == int(answer.best.matched.sum()) == 8
    assert explanations.search.complete


def test_the_report_of_the_search_is_handed_on() -> None:
    assert not search_and_rank(context_of(ROOM_INDEX, SCAN, deadline=Deadline(at=0.0))).search.complete
    assert search_and_rank(context_of(ROOM_INDEX, scan_of(np.zeros((0, 4))), seed=9)).search.seed == 9


def test_a_pose_that_is_given_is_explained_as_one_that_was_found() -> None:
    context = context_of(index_of(ROOM + 50.0), SCAN)
    found, given = (
        search_and_rank(context).answer,
        estimate_at(context, pose(INSIDE.x + 50.0, INSIDE.y + 50.0, INSIDE.theta)),
    )
    assert found is not None
    assert given.answer is not None
    assert list(given.alternatives) == []
    assert not given.search.complete
    assert given.answer.best.score == pytest.approx(found.best.score, abs=1e-6)
    assert same_pose(given.answer.estimated.pose, found.estimated.pose, 1e-6, 1e-6)
