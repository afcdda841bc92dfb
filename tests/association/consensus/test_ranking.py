"""Explanations come in order: within the window first, by score and prior, none twice."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from association import Beams, CancelledError, Deadline, HardPrior, MapIndex, Prior, SoftPrior, associate
from association import rank_and_estimate as stage
from association.consensus import beams as single_beams
from association.consensus import ranking
from association.consensus.beams import beam_evidence_at
from association.consensus.consensus_set import ConsensusSet
from association.consensus.kernels.beams import weigh_beams
from association.consensus.ranking import rank_candidates
from association.consensus.sight import missing_segments
from association.consensus.tuning import (
    BEAM_FINALISTS,
    BEAMS_PASSED,
    BEAMS_READ,
    LATE_FINALISTS,
    MOST_BEAMS,
)
from association.context import SearchContext
from association.layout import ESTIMATE, FOUND, record
from association.rank_and_estimate import search_and_rank
from association.search.candidates import find_candidates
from association.tables import Rays
from association.tuning import FEW_KEPT
from registration import RigidTransform
from registration.layout import Floats, Records

from ..answers import ranked
from ..records import rays_of
from ..reference import beams as beams_twin
from ..reference import ranking as twin
from ..reference.best_poses import prior_value
from ..scenes import (
    ANGLES,
    INSIDE,
    ROOM,
    beams_of,
    context_of,
    equal_rooms,
    index_of,
    local,
    pose,
    read,
    same_pose,
    scan_of,
    seen,
)

ENDPOINTS = seen(ROOM, INSIDE)[0]
ROOM_SCAN = scan_of(ENDPOINTS)


def room(k: int) -> RigidTransform:
    """Return where the sensor stands in room k of `equal_rooms`."""
    return pose(INSIDE.x + 12.0 * k, INSIDE.y, INSIDE.theta)


def candidates_of(index: MapIndex, poses: list[RigidTransform]) -> Records:
    """Return poses of the map frame as if a search had found them, in that order."""
    found = np.zeros(len(poses), FOUND)
    for row, at in zip(found, poses, strict=True):
        here = local(index, at)
        row["theta"], row["x"], row["y"] = here.theta, here.x, here.y
    return found


def ranked_at(context: SearchContext, *poses: RigidTransform) -> list[ConsensusSet]:
    return rank_candidates(context, candidates_of(context.index, list(poses)))


def places(context: SearchContext, found: list[ConsensusSet]) -> list[RigidTransform]:
    return [context.in_map(one.pose) for one in found]


def test_what_an_explanation_says_of_its_pose() -> None:
    covariance = np.array([[0.09, 0.02, 0.001], [0.02, 0.04, 0.002], [0.001, 0.002, 1e-3]])
    one = ranked(at=pose(1.0, -2.0, 0.3), covariance=covariance, matched=3)
    assert one.pose == pose(1.0, -2.0, 0.3)
    np.testing.assert_allclose(one.covariance, covariance)
    assert one.deviation == pytest.approx(math.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[1]))
    assert one.matched.tolist() == [True] * 3 + [False] * 5


def test_the_best_comes_first_with_what_belongs_to_it() -> None:
    """Of three rooms the second lacks no wall, the first one and the third two; a fourth pose lies nowhere."""
    walls = np.vstack([ROOM[:-1], equal_rooms(2)[8:], ROOM[1:-1] + np.tile([24.0, 0.0], 2)])
    context = context_of(index_of(walls), ROOM_SCAN)
    found = ranked_at(context, room(0), pose(500.0), room(2), room(1))
    assert [same_pose(at, room(k), 1e-6, 1e-6) for at, k in zip(places(context, found), (1, 0, 2), strict=True)] == [
        True
    ] * 3
    here = [local(context.index, room(k)) for k in (1, 0, 2)]
    expected = twin.rank(context.lines.rows, here, None, context.index.tables.place, context.gates, context.lines.model)
    for one, (at, covariance, scored, matches) in zip(found, expected, strict=True):
        assert same_pose(one.pose, at, 1e-6, 1e-6)
        np.testing.assert_allclose(one.covariance, covariance, rtol=1e-4, atol=1e-9)
        score, chi_square, one_step, length, fraction, misfit, _, read, passed, count = scored[0].item()
        assert (one.score, one.posterior, one.length) == pytest.approx((score, score, length))
        assert (one.chi_square, one.one_step_chi_square) == pytest.approx((chi_square, one_step), rel=1e-5, abs=1e-6)
        assert (one.fraction, one.misfit) == pytest.approx((fraction, misfit), abs=1e-6)
        assert (one.read, one.passed, one.count) == (read, passed, count) == (0.0, 0.0, one.matched.sum())
        np.testing.assert_array_equal(one.matches["wall"], matches["wall"])
        assert one.inside
    assert [round(one.fraction, 3) for one in found] == [1.0, round(26.5 / 32.0, 3), round(17.5 / 32.0, 3)]


def test_lines_of_sight_count_where_there_are_no_beams() -> None:
    index = index_of(np.vstack([ROOM, [[4.5, 0.5, 4.5, 3.5]]]))
    blind, sighted = (
        ranked_at(context_of(index, scan_of(ENDPOINTS, viewpoint=at)), INSIDE)[0] for at in (None, (0.0, 0.0))
    )
    assert blind.score - sighted.score > 3.0


@pytest.mark.parametrize(("wanted", "count"), [(5, FEW_KEPT), (FEW_KEPT + 2, FEW_KEPT + 3), (50, 30)])
def test_so_many_are_told_apart_as_may_be_deciding_place(wanted: int, count: int) -> None:
    """One more than the alternatives, and enough for the verdict."""
    context = context_of(index_of(equal_rooms(30)), ROOM_SCAN, max_alternatives=wanted)
    assert len(ranked_at(context, *map(room, range(30)))) == count


@pytest.mark.parametrize(
    ("by", "count"),
    [
        (pose(0.2), 1),
        (pose(0.5), 2),
        (pose(0.0, 0.0, 0.05), 1),
        (pose(0.0, 0.0, 0.2), 2),
    ],
)
def test_explanations_near_each_other_are_one(by: RigidTransform, count: int) -> None:
    """On a map that has a room twice, the second time moved as the sensor would be."""
    moved = INSIDE.compose(by).compose(INSIDE.inverse())
    again = moved.apply(ROOM.reshape(-1, 2, 2)).reshape(-1, 4)
    context = context_of(index_of(np.vstack([ROOM, again])), ROOM_SCAN, angle_tolerance=0.02, offset_tolerance=0.05)
    assert len(ranked_at(context, INSIDE, INSIDE.compose(by))) == count


def test_a_soft_prior_counts_in_the_order() -> None:
    prior = SoftPrior(room(2), np.diag([16.0, 1.0, 1.0]))
    context = context_of(index_of(equal_rooms(3)), ROOM_SCAN, prior)
    found = ranked_at(context, room(0), room(1), room(2))
    for one, k in zip(found, (2, 1, 0), strict=True):
        assert same_pose(context.in_map(one.pose), room(k), 1e-6, 1e-6)
        assert one.posterior - one.score == pytest.approx(prior_value(prior, room(k)), abs=1e-5)
        assert one.inside


def test_poses_within_a_window_come_first() -> None:
    """However good the others are; the window counts in no value."""
    index = index_of(np.vstack([ROOM, ROOM[2:] + np.tile([12.0, 0.0], 2)]))
    context = context_of(index, ROOM_SCAN, HardPrior(room(1), 0.5, 0.3))
    found = ranked_at(context, room(0), room(1))
    assert [one.inside for one in found] == [True, False]
    assert found[0].score < found[1].score - 10.0
    assert all(one.posterior == one.score for one in found)
    assert same_pose(context.in_map(found[0].pose), room(1), 1e-6, 1e-6)


def with_gaps(ranges: Floats, unknown: int) -> Beams:
    """Return beams of which some are not known."""
    told = ranges.copy()
    told[:unknown] = math.nan
    return Beams(ANGLES, told, 20.0)


@pytest.mark.parametrize("unknown", [0, 70])
def test_beams_count_in_the_score_and_move_the_pose(unknown: int) -> None:
    """At most 180 of those of which something is known, evenly spread."""
    index = index_of(equal_rooms(2))
    beams = with_gaps(read(index, INSIDE), unknown)
    context = context_of(index, scan_of(ENDPOINTS, viewpoint=(0.0, 0.0), beams=beams))
    found = ranked_at(context, INSIDE)[0]
    known = ~np.isnan(beams.ranges)
    step = math.ceil(known.sum() / MOST_BEAMS)
    rays = rays_of(beams.angles[known][::step], beams.ranges[known][::step])
    place, here = index.tables.place, local(index, INSIDE)
    moved, (reading, passed), _ = beams_twin.weigh_beams(rays, here, place, place)
    ((_, _, scored, _),) = twin.rank(context.lines.rows, [moved], None, place, context.gates, context.lines.model)
    expected = scored["score"][0] + BEAMS_READ * reading - BEAMS_PASSED * passed
    assert (found.read, found.passed) == pytest.approx((reading, passed), abs=1e-4)
    assert found.score == pytest.approx(expected, abs=0.01)


def test_beams_that_pass_through_walls_speak_against_a_pose() -> None:
    """A room and a similar one with a screen, before which and behind which the beams end."""
    index = index_of(np.vstack([equal_rooms(2), [[19.5, 0.5, 19.5, 3.8]]]))
    context = context_of(index, scan_of(ENDPOINTS, viewpoint=(0.0, 0.0), beams=beams_of(index, INSIDE)))
    found = ranked_at(context, room(1), room(0))
    assert same_pose(context.in_map(found[0].pose), room(0), 1e-3, 1e-3)
    assert found[0].score - found[1].score > 0.1 * BEAMS_READ


def test_what_beams_speak_against_altogether_is_none() -> None:
    """All of them pass through a wall that is a metre before them."""
    index = index_of(ROOM)
    beams = Beams(ANGLES, read(index, INSIDE) + 1.0, 20.0)
    context = context_of(index, scan_of(ENDPOINTS[:1], viewpoint=(0.0, 0.0), beams=beams))
    assert ranked_at(context, INSIDE) == []


def crowded(prior: Prior | None, at: float | None = None) -> list[ConsensusSet]:
    """Rank 40 equal rooms and one that lacks walls, all of them candidates."""
    poor = ROOM[3:] + np.tile([0.0, 50.0], 2)
    index = index_of(np.vstack([equal_rooms(40), poor]))
    scan = scan_of(ENDPOINTS, viewpoint=(0.0, 0.0), beams=beams_of(index, INSIDE))
    context = replace(context_of(index, scan, prior, max_alternatives=50), deadline=Deadline(at))
    return ranked_at(context, *map(room, range(40)), pose(INSIDE.x, INSIDE.y + 50.0, INSIDE.theta))


def test_single_beams_are_looked_at_for_the_best_alone() -> None:
    assert len(crowded(None)) == BEAM_FINALISTS


def test_they_are_looked_at_for_few_when_the_deadline_has_passed() -> None:
    assert len(crowded(None, at=0.0)) == LATE_FINALISTS


@pytest.mark.parametrize("at", [None, 0.0])
def test_what_lies_in_a_window_is_looked_at_however_good_the_others_are(at: float | None) -> None:
    found = crowded(HardPrior(pose(INSIDE.x, INSIDE.y + 50.0, INSIDE.theta), 0.5, 0.3), at)
    assert [one.inside for one in found] == [True] + [False] * (len(found) - 1)
    assert found[0].score < found[1].score


def test_nothing_found_is_nothing_ranked() -> None:
    index = index_of(ROOM)
    beams = beams_of(index, INSIDE)
    for scan in (scan_of(np.zeros((0, 4))), scan_of(np.zeros((0, 4)), viewpoint=(0.0, 0.0), beams=beams)):
        context = context_of(index, scan)
        assert rank_candidates(context, find_candidates(context).poses) == []


class Looked(Deadline):
    """A deadline that passes at the so-manieth look."""

    def __init__(self, looks: int) -> None:
        super().__init__()
        object.__setattr__(self, "looks", looks)

    @property
    def passed(self) -> bool:
        object.__setattr__(self, "looks", self.looks - 1)
        return self.looks < 0

    looks: int


def test_between_poses_the_clock_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """2,000 parallel walls held a search for 150 s."""
    index = index_of(equal_rooms(3))
    candidates = candidates_of(index, [room(k) for k in range(3)])
    everything = rank_candidates(context_of(index, ROOM_SCAN), candidates)
    assert len(everything) == 3
    walls = [one.matches["wall"].tolist() for one in everything]
    monkeypatch.setattr(ranking, "RANKED_AT_ONCE", 1)
    for looks in range(4):
        some = rank_candidates(replace(context_of(index, ROOM_SCAN), deadline=Looked(looks)), candidates)
        assert len(some) == min(3, looks + 1)
        assert all(one.matches["wall"].tolist() in walls for one in some)


def test_who_has_left_is_not_ranked_for() -> None:
    index = index_of(equal_rooms(3))
    context = context_of(index, ROOM_SCAN)
    context.deadline.cancel()
    with pytest.raises(CancelledError):
        ranked_at(context, room(0))


def test_no_rays_are_followed_through_a_crowd_when_the_deadline_has_passed() -> None:
    """Ten thousand walls in one place: of the lines of sight alone the answer would come 70 ms late."""
    rng = np.random.default_rng(0)
    near = np.array([INSIDE.x + 0.5, INSIDE.y + 0.5])
    middles, angles = near + rng.uniform(0.0, 1.0, (1_500, 2)), rng.uniform(-math.pi, math.pi, 1_500)
    half = 0.05 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    crowd = np.hstack([middles - half, middles + half])
    index = index_of(np.vstack([ROOM, crowd]))
    scan = scan_of(ENDPOINTS, viewpoint=(0.0, 0.0))
    in_time = context_of(index, scan)
    candidates = find_candidates(in_time)
    late = replace(in_time, deadline=Deadline(at=0.0))
    (best, *_), (hurried, *_) = rank_candidates(in_time, candidates.poses), rank_candidates(late, candidates.poses)
    assert hurried.blocked == 0.0 < best.blocked
    assert missing_segments(late, best) == () != missing_segments(in_time, best)
    sparse = replace(context_of(index_of(ROOM), scan), deadline=Deadline(at=0.0))
    assert not sparse.too_late_to_look


def test_what_the_deadline_leaves_unranked_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    context = replace(context_of(index_of(equal_rooms(3)), ROOM_SCAN), deadline=Deadline(at=time.monotonic() + 1e3))
    assert search_and_rank(context).search.complete
    # It passes after the last base and before the first pose is ranked: there is an answer all the same.
    candidates = find_candidates(context)
    late = replace(context, deadline=Deadline(at=0.0))
    assert candidates.report.complete
    assert len(rank_candidates(late, candidates.poses)) == len(rank_candidates(context, candidates.poses)) > 0
    monkeypatch.setattr(stage, "find_candidates", lambda context, effort: candidates)
    assert search_and_rank(context).search.complete
    assert not search_and_rank(late).search.complete


@pytest.mark.parametrize("beams", [True, False])
def test_where_no_ray_can_be_followed_the_answer_is_not_usable(beams: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The pose is that of the segments; evidence against it was not computed."""
    index = index_of(ROOM)
    scan = scan_of(ENDPOINTS, viewpoint=(0.0, 0.0), beams=beams_of(index, INSIDE) if beams else None)
    assert associate(index, scan).usable
    monkeypatch.setattr("association.context.MOST_LOOKED_AT", 1)
    found = associate(index, scan)
    assert found.pose is not None
    assert same_pose(found.pose, INSIDE, 1e-3, 1e-3)
    assert (found.usable, found.search.complete, found.reasons[0].code) == (False, False, "search_incomplete")
    [warning] = [one for one in found.warnings if one.code == "search_incomplete"]
    assert "walls lie in one place of the map" in warning.message


def test_the_clock_is_looked_at_between_the_beams_of_some_poses(monkeypatch: pytest.MonkeyPatch) -> None:
    index = index_of(equal_rooms(3))
    context = context_of(index, scan_of(ENDPOINTS, viewpoint=(0.0, 0.0), beams=beams_of(index, INSIDE)))
    poses = np.concatenate([room_estimate(index, k) for k in range(3)])
    whole = beam_evidence_at(context, poses.copy(), 60, 2)
    calls: list[int] = []

    def counted(rays: Rays, some: Records, *rest: Any) -> None:
        calls.append(len(some))
        weigh_beams(rays, some, *rest)

    monkeypatch.setattr(single_beams, "weigh_beams", counted)
    monkeypatch.setattr(single_beams, "MOST_LOOKED_AT", 1.5 * context.looks)
    np.testing.assert_array_equal(beam_evidence_at(context, poses.copy(), 60, 2), whole)
    assert calls == [1, 1, 1]
    late = replace(context, deadline=Deadline(at=0.0))
    evidence = beam_evidence_at(late, poses.copy(), 60, 2)
    assert evidence[0] == whole[0]
    assert not evidence[1:]["read"].any()


def room_estimate(index: MapIndex, k: int) -> Records:
    """Return the pose in the k-th of some equal rooms, (1,) of `ESTIMATE`."""
    at = local(index, room(k))
    return record(ESTIMATE, x=at.x, y=at.y, theta=at.theta)


@pytest.mark.parametrize("lacking", [0, 3])
def test_alternatives_have_their_lines_of_sight_however_far_behind(lacking: int) -> None:
    """Of two rooms the second has a screen that the scan sees through, and may lack some of the walls."""
    second = ROOM[: len(ROOM) - lacking] + np.tile([20.0, 0.0], 2)
    index = index_of(np.vstack([ROOM, second, [[24.0, 0.5, 24.0, 3.5]]]))
    context = context_of(index, scan_of(ENDPOINTS, viewpoint=(0.0, 0.0)))
    places = [INSIDE, pose(INSIDE.x + 20.0, INSIDE.y, INSIDE.theta)]
    both = rank_candidates(context, candidates_of(index, places))
    alone = rank_candidates(context, candidates_of(index, places[1:]))[0]
    (other,) = ranking.with_lines_of_sight(context, both, both[1:])
    assert other.score == pytest.approx(alone.score, abs=1e-6)
    assert other.posterior == pytest.approx(alone.posterior, abs=1e-6)
    assert (other.score < both[1].score - 1.0) is (lacking > 0)


def test_alternatives_stay_in_order_when_lines_of_sight_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those within the window first; what comes to nothing is left out, and what is near the best stays as it is."""
    best, near = ranked(100.0), ranked(90.0)
    far = [ranked(70.0, at=pose(1.0)), ranked(60.0, at=pose(2.0)), ranked(5.0, at=pose(3.0))]
    outside = [ranked(74.0, inside=False, at=pose(4.0)), ranked(8.0, inside=False, at=pose(5.0))]

    def charged(_: SearchContext, one: ConsensusSet) -> ConsensusSet:
        blocked = {1.0: 20.0, 3.0: 6.0, 4.0: 70.0}.get(one.pose.x, 0.0)
        return replace(one, score=one.score - blocked, posterior=one.posterior - blocked, blocked=blocked)

    monkeypatch.setattr(ranking, "charge_for_sight", charged)
    context = context_of(index_of(ROOM), scan_of(ENDPOINTS, viewpoint=(0.0, 0.0)))
    others = [near, *far, *outside]
    found = list(ranking.with_lines_of_sight(context, [best, *others], others))
    assert [one.score for one in found] == [90.0, 60.0, 50.0, 8.0, 4.0]
    assert [one.inside for one in found] == [True, True, True, False, False]
    blind = context_of(index_of(ROOM), ROOM_SCAN)
    assert list(ranking.with_lines_of_sight(blind, [best, *others], others)) == others
