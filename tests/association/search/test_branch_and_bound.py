"""Poses that the ends of beams give, where bases have none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from association import CancelledError, Deadline, HardPrior, associate
from association.context import SearchContext
from association.layout import FOUND, record
from association.search import branch_and_bound
from association.search.branch_and_bound import add_point_matches
from association.search.candidates import Candidates, find_candidates
from association.search.tuning import KEPT
from registration import Beams

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
HERE = pose(15.0, 14.0, 0.5)
# One of the lines that are seen from there: no base can be made of it.
ONE_LINE = seen(maze(1), HERE, radius=8.0)[0][:1]


def asked(beams: Beams | None, **how: object) -> SearchContext:
    return context_of(MAZE, scan_of(ONE_LINE, viewpoint=(0.0, 0.0), beams=beams), **how)  # type: ignore[arg-type]


def nothing(context: SearchContext) -> Candidates:
    """Return a search that found nothing."""
    found = find_candidates(context)
    return replace(found, poses=found.poses[:0])


def near_the_truth(context: SearchContext, candidates: Candidates) -> bool:
    there = [(one["x"], one["y"], one["theta"]) for one in candidates.poses]
    return any(same_pose(pose(*at), local(MAZE, HERE), 0.05, 0.01) for at in there)


def test_a_pose_is_found_without_any_base() -> None:
    context = asked(beams_of(MAZE, HERE))
    before = nothing(context)
    found = add_point_matches(context, before)
    assert near_the_truth(context, found)
    assert 1 <= len(found.poses) <= KEPT
    assert found.report == before.report


def test_the_answer_is_the_pose_that_bases_miss() -> None:
    context = asked(beams_of(MAZE, HERE))
    assert not near_the_truth(context, find_candidates(context))
    answer = associate(MAZE, context.scan)
    assert answer.pose is not None
    assert same_pose(answer.pose, HERE, 0.05, 0.01)


def test_no_more_is_searched_where_the_answer_is_usable() -> None:
    index = index_of(maze(2))
    scan = scan_of(seen(maze(2), HERE, radius=8.0)[0], viewpoint=(0.0, 0.0), beams=beams_of(index, HERE))
    assert associate(index, scan).usable
    assert "likelihood_field" not in vars(index)


def test_no_more_is_searched_where_the_beams_end_on_walls_already() -> None:
    context = asked(beams_of(MAZE, HERE))
    at = local(MAZE, HERE)
    here = replace(nothing(context), poses=record(FOUND, x=at.x, y=at.y, theta=at.theta))
    assert add_point_matches(context, here) is here


def test_people_about_the_sensor_do_not_hide_it() -> None:
    """Two beams of five end on people within a metre."""
    ranges, rng = read(MAZE, HERE), np.random.default_rng(3)
    ranges[rng.random(len(ranges)) < 0.4] = 0.6
    context = asked(Beams(ANGLES, ranges, 20.0))
    assert near_the_truth(context, add_point_matches(context, nothing(context)))


@pytest.mark.parametrize("case", ["no beams", "window", "no returns", "after the deadline", "large"])
def test_without_what_it_takes_the_candidates_stay(case: str, monkeypatch: pytest.MonkeyPatch) -> None:
    beams, how = beams_of(MAZE, HERE), {}
    if case == "window":
        how = {"prior": HardPrior(HERE, 1.0, 0.5)}
    if case == "no returns":
        beams = Beams(ANGLES, np.full(len(ANGLES), np.inf), 20.0)
    context = asked(None if case == "no beams" else beams, **how)
    before = nothing(context)
    if case == "after the deadline":
        context = asked(beams, deadline=Deadline(at=0.0))
    if case == "large":
        monkeypatch.setitem(vars(MAZE), "likelihood_field", None)
    assert add_point_matches(context, before) is before


def test_what_the_deadline_cuts_short_is_not_complete(monkeypatch: pytest.MonkeyPatch) -> None:
    def cut(*arguments: object) -> int:
        arguments[-1][0] = 1  # type: ignore[index]
        return 0

    context = asked(beams_of(MAZE, HERE))
    monkeypatch.setattr(branch_and_bound, "branch_and_bound", cut)
    found = add_point_matches(context, nothing(context))
    assert not found.report.complete
    assert len(found.poses) == 0


def test_a_search_that_is_cancelled_has_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    deadline = Deadline()
    context = asked(beams_of(MAZE, HERE), deadline=deadline)
    before = nothing(context)

    def cancel(*_: object) -> int:
        deadline.cancel()
        return 0

    monkeypatch.setattr(branch_and_bound, "branch_and_bound", cancel)
    with pytest.raises(CancelledError):
        add_point_matches(context, before)
