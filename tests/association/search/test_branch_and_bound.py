"""Poses that the ends of beams give, where bases have none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from association.search.branch_and_bound import PointMatches, match_points

from association import CancelledError, Deadline, HardPrior, SoftPrior, associate
from association.context import SearchContext
from association.layout import FOUND, record
from association.search import branch_and_bound
from association.search.candidates import find_candidates
from association.search.tuning import FIELD_GAP, KEPT
from registration import Beams, RigidTransform
from registration.layout import Records

from ..scenes import (
    ANGLES,
    beams_of,
    context_of,
    index_of,
    local,
    maze,
    pose,
    read,
    same_pose,
    scan_of,
    seen,
)

MAZE = index_of(maze(1))
L_ROOM = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
HERE = pose(15.0, 14.0, 0.5)
# One of the lines that are seen from there: no base can be made of it.
ONE_LINE = seen(maze(1), HERE, radius=8.0)[0][:1]


def asked(beams: Beams | None, **how: object) -> SearchContext:
    return context_of(MAZE, scan_of(ONE_LINE, viewpoint=(0.0, 0.0), beams=beams), **how)  # type: ignore[arg-type]


NOTHING = np.zeros(0, FOUND)


def found_at(at: RigidTransform) -> Records:
    there = local(MAZE, at)
    return record(FOUND, x=there.x, y=there.y, theta=there.theta)


def near_the_truth(poses: Records) -> bool:
    there = [(one["x"], one["y"], one["theta"]) for one in poses]
    return any(same_pose(pose(*at), local(MAZE, HERE), 0.05, 0.01) for at in there)


def matched(context: SearchContext, candidates: Records = NOTHING, answer: Records = NOTHING) -> PointMatches:
    found = match_points(context, candidates, answer)
    assert found is not None
    return found


def test_a_pose_is_found_without_any_base() -> None:
    found = matched(asked(beams_of(MAZE, HERE)))
    assert near_the_truth(found.poses[:1])
    assert 1 <= len(found.poses) <= KEPT
    assert found.complete
    assert found.decisive is not None
    assert same_pose(found.decisive, local(MAZE, HERE), 0.05, 0.01)
    assert (np.diff(found.means) <= 0.0).all()
    assert found.means[-1] >= found.means[0] - FIELD_GAP


def test_the_answer_is_the_pose_that_bases_miss() -> None:
    context = asked(beams_of(MAZE, HERE))
    assert not near_the_truth(find_candidates(context).poses)
    answer = associate(MAZE, context.scan)
    assert answer.pose is not None
    assert same_pose(answer.pose, HERE, 0.05, 0.01)


def test_no_more_is_searched_where_the_answer_is_usable() -> None:
    index = index_of(maze(2))
    scan = scan_of(seen(maze(2), HERE, radius=8.0)[0], viewpoint=(0.0, 0.0), beams=beams_of(index, HERE))
    assert associate(index, scan).usable
    assert "likelihood_field" not in vars(index)


def test_no_more_is_searched_where_the_beams_end_on_walls_at_the_answer() -> None:
    """But it is if another candidate explains many more of them, or if there is no answer."""
    context = asked(beams_of(MAZE, HERE))
    here, elsewhere = found_at(HERE), found_at(HERE.compose(pose(0.6, 0.6)))
    assert match_points(context, elsewhere, here) is None
    assert match_points(context, here, elsewhere) is not None
    assert match_points(context, here, NOTHING) is not None


def test_another_place_as_good_leaves_a_doubt() -> None:
    """The corridor's two ends are alike: the pose of one is that of the other, turned round."""
    for walls, decisive in (([[0, 0, 12, 0], [12, 0, 12, 2], [12, 2, 0, 2], [0, 2, 0, 0]], False), (L_ROOM, True)):
        index = index_of(walls)
        context = context_of(
            index, scan_of([[0, 0, 1, 0]], viewpoint=(0.0, 0.0), beams=beams_of(index, pose(1.0, 1.0)))
        )
        found = match_points(context, NOTHING, NOTHING)
        assert found is not None
        assert (found.decisive is not None) is decisive


def test_a_decision_of_points_is_the_answer_and_cannot_be_used() -> None:
    """The segments alone prefer another pose, because most of them are clutter that fits there."""
    ranges, rng = read(MAZE, HERE), np.random.default_rng(3)
    ranges[rng.random(len(ranges)) < 0.3] = 0.6
    few, clutter = seen(maze(1), HERE, radius=6.0)[0][:3], seen(maze(1), pose(8.0, 20.0, 1.0), radius=10.0)[0]
    scan = scan_of(np.vstack([few, clutter]), viewpoint=(0.0, 0.0))
    before = associate(MAZE, scan)
    assert before.pose is not None
    assert not same_pose(before.pose, HERE, 0.5, 0.1)
    answer = associate(MAZE, replace(scan, beams=Beams(ANGLES, ranges, 20.0)))
    assert answer.pose is not None
    assert same_pose(answer.pose, HERE, 0.05, 0.02)
    assert not answer.usable
    assert str(answer.status) in ("ambiguous", "degenerate")
    assert max(one.score for one in answer.alternatives) > answer.diagnostics.score  # type: ignore[union-attr]
    with_prior = associate(MAZE, replace(scan, beams=Beams(ANGLES, ranges, 20.0)), SoftPrior(before.pose, np.eye(3)))
    assert with_prior.pose is None or not same_pose(with_prior.pose, HERE, 0.5, 0.1)


def test_people_about_the_sensor_do_not_hide_it() -> None:
    """Two beams of five end on people within a metre."""
    ranges, rng = read(MAZE, HERE), np.random.default_rng(3)
    ranges[rng.random(len(ranges)) < 0.4] = 0.6
    context = asked(Beams(ANGLES, ranges, 20.0))
    assert near_the_truth(matched(context).poses)


@pytest.mark.parametrize("case", ["no beams", "window", "no returns", "after the deadline", "large"])
def test_without_what_it_takes_nothing_is_searched(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    beams, how = beams_of(MAZE, HERE), {}
    if case == "window":
        how = {"prior": HardPrior(HERE, 1.0, 0.5)}
    if case == "no returns":
        beams = Beams(ANGLES, np.full(len(ANGLES), np.inf), 20.0)
    context = asked(None if case == "no beams" else beams, **how)
    if case == "after the deadline":
        context = asked(beams, deadline=Deadline(at=0.0))
    if case == "large":
        monkeypatch.setitem(vars(MAZE), "likelihood_field", None)
    assert match_points(context, NOTHING, NOTHING) is None


def test_what_the_deadline_cuts_short_is_not_complete(monkeypatch: pytest.MonkeyPatch) -> None:
    def cut(*arguments: object) -> int:
        arguments[-1][0] = 1  # type: ignore[index]
        return 0

    context = asked(beams_of(MAZE, HERE))
    monkeypatch.setattr(branch_and_bound, "branch_and_bound", cut)
    found = matched(context)
    assert not found.complete
    assert found.decisive is None
    assert len(found.poses) == 0


def test_a_search_that_is_cancelled_has_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    deadline = Deadline()
    context = asked(beams_of(MAZE, HERE), deadline=deadline)

    def cancel(*_: object) -> int:
        deadline.cancel()
        return 0

    monkeypatch.setattr(branch_and_bound, "branch_and_bound", cancel)
    with pytest.raises(CancelledError):
        match_points(context, NOTHING, NOTHING)
