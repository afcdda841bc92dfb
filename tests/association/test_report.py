"""The report has the result in the map frame, with the indices of the caller."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from association import AssociationResult, MapIndex, Reason, Status, View, assemble, message_of
from association.consensus.acceptance import Accepted
from association.explanations import Answer
from association.rank_and_estimate import search_and_rank
from association.verdict.verdict import Verdict, judge
from association.verdict.vetoes import BETTER_ELSEWHERE, INCOMPLETE
from registration import RigidTransform, Segments
from registration.layout import Floats

from .answers import (
    ROOM_INDEX,
    SCAN,
    answer_with,
    estimated_of,
    explanations_of,
    leverages_of,
    ranked,
    registered_room,
    report_of,
    room,
)
from .scenes import (
    CORRIDOR,
    INSIDE,
    ROOM,
    SQUARE,
    answer_of,
    context_of,
    equal_rooms,
    index_of,
    pose,
    pose_in,
    scan_of,
    seen,
)

SURE = Verdict(Status.OK, 0.97, True, pose(1.0, 2.0, 0.3), 20.0, 0.75, ())
WHY = (Reason("similar_place", "Another pose fits the scan about as well."),)
ROOMS = index_of(equal_rooms(4))


def given_answer() -> Answer:
    """Return an answer of the first three segments of the scan."""
    pairs, overlaps = np.array([[0, 4], [1, 9], [2, 2]]), np.array([0.9, 0.8, 0.7])
    accepted = Accepted(pairs, overlaps, np.array([6, 7, 15]), np.array([0, 2, 2, 3]))
    offsets, angles, weights = np.array([0.01, 0.02, 0.03]), np.array([0.1, 0.2, 0.3]), np.array([5.0, 6.0, 7.0])
    registered = replace(registered_room(), offsets=offsets, angles=angles, weights=weights)
    return answer_with(ranked(80.0, -2.0, fraction=0.6), registered, accepted=accepted, significance=1e-5)


def told(answer: Answer | None, verdict: Verdict = SURE, **options: Any) -> AssociationResult:
    """Report an answer next to another explanation."""
    context = context_of(ROOM_INDEX, SCAN, **options)
    return report_of(context, explanations_of(answer, ranked(60.0)), verdict)


def test_what_is_found_and_concluded_is_told() -> None:
    result, registered = told(given_answer()), registered_room()
    assert (result.status, result.usable, result.probability, result.pose) == (Status.OK, True, 0.97, SURE.pose)
    assert result.unobservable is None
    np.testing.assert_array_equal(result.covariance, given_answer().estimated.covariance)
    assert result.reasons == ()
    assert result.search == explanations_of(None).search
    diagnostics = result.diagnostics
    assert diagnostics is not None
    assert diagnostics.registration == registered.diagnostics
    assert (diagnostics.inlier_fraction, diagnostics.score, diagnostics.significance) == (0.6, 80.0, 1e-5)
    assert (diagnostics.runner_up, diagnostics.margin) == (0.75, 20.0)


def test_correspondences_by_the_indices_that_were_sent() -> None:
    """Of 8 map segments; pieces from 8 on are the same ones the other way round."""
    result = told(given_answer())
    got = [(c.scan, c.map, c.overlap, c.offset, c.angle, c.weight, c.alternatives) for c in result.correspondences]
    assert [(*one[:2], *one[3:]) for one in got] == [
        (0, 4, 0.01, 0.1, 5.0, (6, 7)),
        (1, 1, 0.02, 0.2, 6.0, ()),
        (2, 2, 0.03, 0.3, 7.0, (7,)),
    ]
    assert result.unmatched_scan == (3, 4, 5, 6, 7)


def overlap_at(wall: Floats, segment: Floats, at: RigidTransform) -> float:
    """Return the share of a scan segment's length that lies along a wall's."""
    d = (wall[2:] - wall[:2]) / np.hypot(*(wall[2:] - wall[:2]))
    along = (at.apply(segment.reshape(2, 2)) - wall[:2]) @ d
    shared = min(along.max(), float((wall[2:] - wall[:2]) @ d)) - max(along.min(), 0.0)
    return float(max(0.0, shared) / np.ptp(along))


@pytest.mark.parametrize("estimator", ["joint", "one_step"])
@pytest.mark.parametrize(
    ("walls", "at"),
    [(ROOM, INSIDE), (SQUARE, pose(1.0, 1.0, 0.2)), (CORRIDOR, pose(9.0, 0.8))],
)
def test_overlaps_are_those_at_the_pose_that_is_answered(walls: Floats, at: RigidTransform, estimator: Any) -> None:
    """Not at the one that the search came by: of a corridor's family another member is answered."""
    compared = 0
    for seed in range(6):
        endpoints = seen(walls, at, noise=0.04, cut=0.1, seed=seed)[0]
        result = answer_of(index_of(walls), scan_of(endpoints, 0.04), min_overlap=0.2, estimator=estimator)
        for pair in result.correspondences:
            expected = overlap_at(walls[pair.map], endpoints[pair.scan], pose_in(result))
            assert pair.overlap == pytest.approx(expected, abs=1e-9)
            compared += 1
    assert compared >= 3


@pytest.mark.parametrize("asked", [(), ("correspondences",), ("missing_map",), ("alternatives", "missing_map")])
def test_parts_that_are_not_deciding_place_are_empty_and_change_nothing_else(asked: tuple[Any, ...]) -> None:
    """Of an answer that is usable, with another pose, and a wall through which it sees."""
    index = index_of(np.vstack([equal_rooms(2)[:-2], [[4.0, 3.3, 5.0, 3.4]]]))
    sent = scan_of(seen(ROOM, INSIDE, noise=0.01, seed=1)[0], viewpoint=(0.0, 0.0))
    explanations = search_and_rank(context_of(index, sent))

    def reported(**options: Any) -> AssociationResult:
        return report_of(context_of(index, sent, **options), explanations, SURE)

    whole, part = reported(), reported(parts=asked)
    for name in ("correspondences", "alternatives", "missing_map"):
        assert getattr(whole, name), name
        assert bool(getattr(part, name)) == (name in asked), name
    for name in ("status", "usable", "probability", "pose", "unmatched_scan", "diagnostics", "reasons", "search"):
        assert getattr(part, name) == getattr(whole, name), name


def test_a_twin_is_as_ambiguous_as_the_best() -> None:
    """Its pairs are the same ones, with the same weights."""
    endpoints = seen(ROOM, INSIDE, noise=0.01, seed=1)[0]
    result = answer_of(index_of(equal_rooms(2)), scan_of(endpoints, 0.03))
    assert result.diagnostics is not None
    best, twin = result.diagnostics.registration, result.alternatives[0]
    assert twin.ambiguity.translation == pytest.approx(best.ambiguity.translation, rel=0.02)
    assert twin.ambiguity.rotation == pytest.approx(best.ambiguity.rotation, rel=0.02)
    assert twin.reliability == pytest.approx(best.reliability, rel=1e-3)


@pytest.mark.parametrize(("rooms", "noise"), [(2, 0.0), (3, 0.02), (4, 0.02)])
def test_equal_poses_share_the_probability(rooms: int, noise: float) -> None:
    result = answer_of(index_of(equal_rooms(rooms)), scan_of(seen(ROOM, INSIDE, noise=noise, seed=1)[0]))
    shares = [other.probability for other in result.alternatives]
    assert result.probability is not None
    assert shares == pytest.approx([result.probability] * (rooms - 1), rel=1e-3)
    assert result.probability * rooms <= 1.0


def test_a_pose_that_fits_worse_is_less_probable() -> None:
    """Of two rooms the second lacks a wall."""
    index = index_of(equal_rooms(2)[:-1])
    result = answer_of(index, scan_of(seen(ROOM, INSIDE, noise=0.02, seed=1)[0]))
    (other,) = result.alternatives
    assert result.probability is not None
    assert other.probability is not None
    assert 0.0 <= other.probability < 0.5 * result.probability


@pytest.mark.parametrize(
    "verdict",
    [
        replace(SURE, status=Status.DEGENERATE, usable=False, probability=None, reasons=WHY),
        replace(SURE, status=Status.AMBIGUOUS, usable=False, vetoes=(BETTER_ELSEWHERE,), reasons=WHY),
        replace(SURE, status=Status.NO_MATCH, usable=False, probability=0.0, pose=None, reasons=WHY),
    ],
    ids=["degenerate", "contradicted", "no match"],
)
def test_without_a_probability_to_share_the_others_have_none(verdict: Verdict) -> None:
    found = told(given_answer(), verdict).alternatives
    assert found
    assert [other.probability for other in found] == [None] * len(found)


def test_what_is_not_usable_has_its_other_poses() -> None:
    """They are counted in the message, whatever `include` names."""
    result = answer_of(index_of(equal_rooms(3)), scan_of(seen(ROOM, INSIDE)[0]), parts=())
    assert not result.usable
    assert len(result.alternatives) == 2
    assert "2 other poses" in message_of(result)


@pytest.mark.parametrize("most", [0, 2, 50])
def test_other_poses_best_first(most: int) -> None:
    """Of four equal rooms the last lacks a wall; each other pose is worked out as the best one is."""
    index = index_of(equal_rooms(4)[:-1])
    result = answer_of(index, scan_of(seen(ROOM, INSIDE, noise=0.02, seed=1)[0]), max_alternatives=most)
    assert len(result.alternatives) == min(most, 3)
    scores = [other.score for other in result.alternatives]
    assert scores == sorted(scores, reverse=True)
    rooms = {
        round((pose_in(result).x - INSIDE.x) / 12.0),
        *(round((a.pose.x - 3.0) / 12.0) for a in result.alternatives),
    }
    assert len(rooms) == 1 + min(most, 3)
    if most == 50:
        assert round((result.alternatives[-1].pose.x - 3.0) / 12.0) == 3
        assert result.alternatives[-1].inlier_fraction < result.alternatives[0].inlier_fraction


def test_the_estimator_chooses_whose_sums_score_and_the_joint_ones_judge() -> None:
    scan = scan_of(seen(ROOM, INSIDE, noise=0.03, cut=0.4, clutter=2, seed=1)[0], 0.03)
    joint, one_step = (answer_of(index_of(equal_rooms(2)), scan, estimator=name) for name in ("joint", "one_step"))
    assert joint.diagnostics is not None
    assert one_step.diagnostics is not None
    # The paper's pose costs more, by how much is the same in the reference.
    lost = joint.diagnostics.score - one_step.diagnostics.score
    assert 1e-3 < lost < 5.0
    assert [j.score - o.score for j, o in zip(joint.alternatives, one_step.alternatives, strict=True)] == [
        pytest.approx(lost)
    ]
    for name in ("status", "usable", "probability", "reasons"):
        assert getattr(joint, name) == getattr(one_step, name)
    assert joint.diagnostics.margin == one_step.diagnostics.margin


@pytest.mark.parametrize("sigma", [0.0, 0.03, None])
def test_an_exact_twin_is_told_as_the_best_is(sigma: float | None) -> None:
    """With the same sigmas: the same ambiguity, reliability, score and covariance."""
    index = MapIndex.build(Segments.from_array(equal_rooms(2)), sigma)
    result = answer_of(index, scan_of(seen(ROOM, INSIDE, noise=0.02, cut=0.4, clutter=2, seed=1)[0]))
    (twin,), diagnostics = result.alternatives, result.diagnostics
    assert diagnostics is not None
    assert (twin.score, twin.inlier_fraction) == pytest.approx((diagnostics.score, diagnostics.inlier_fraction))
    assert twin.reliability == pytest.approx(diagnostics.registration.reliability)
    for name in ("rotation", "translation"):
        expected = getattr(diagnostics.registration.ambiguity, name)
        assert getattr(twin.ambiguity, name) == pytest.approx(expected, rel=1e-6)
        assert expected > 0.0
    assert twin.covariance is not None
    assert result.covariance is not None
    np.testing.assert_allclose(twin.covariance, result.covariance, rtol=1e-6, atol=1e-12)


def test_a_free_alternative_has_no_covariance() -> None:
    """The scan of a corridor's end, which the middle of another corridor explains in part."""
    walls = np.vstack([CORRIDOR, [[30.0, 0.0, 30.0, 2.0]], CORRIDOR + np.tile([0.0, 20.0], 2)])
    result = answer_of(
        index_of(walls), scan_of([[-6.0, -0.8, 3.0, -0.8], [3.0, 1.2, -6.0, 1.2], [3.0, -0.8, 3.0, 1.2]])
    )
    assert result.covariance is not None
    other = next(a for a in result.alternatives if abs(a.pose.y - 20.8) < 0.1)
    assert other.covariance is None


def test_no_wall_is_critical_where_the_pose_stays_without_any() -> None:
    for leverages in (leverages_of(), leverages_of((1, 0.09, 0.02), (2, 0.01, 0.099))):
        answer = replace(given_answer(), estimated=estimated_of(registered_room(), leverages))
        diagnostics = told(answer).diagnostics
        assert diagnostics is not None
        assert diagnostics.critical_wall is None


@pytest.mark.parametrize(("moves", "deviation", "least"), [(0.3, 0.05, 0.3), (0.05, 0.4, 0.4)])
def test_the_critical_wall_is_that_without_which_the_pose_moves_most_or_is_free(
    moves: float, deviation: float, least: float
) -> None:
    """By the indices that were sent: scan segments of row 2 lie on wall 2, which is that piece of the map."""
    leverages = leverages_of((1, 0.2, 0.02), (2, moves, deviation), (0, 0.25, 0.1))
    answer = replace(given_answer(), estimated=estimated_of(registered_room(), leverages))
    diagnostics = told(answer).diagnostics
    assert diagnostics is not None
    wall = diagnostics.critical_wall
    assert wall is not None
    rows = context_of(ROOM_INDEX, SCAN).lines.row_of
    on_it = [(scan, piece % 8) for scan, piece in answer.accepted.pairs.tolist() if rows[scan] == 2]
    assert (list(wall.scan), list(wall.map)) == ([s for s, _ in on_it], sorted({p for _, p in on_it}))
    assert wall.direction == (0.6, 0.8)
    assert wall.displacement == pytest.approx(least)


def test_at_a_corridors_end_that_wall_is_critical() -> None:
    """It was seen in two pieces, and is drawn in two; without it the place along the corridor is free."""
    walls = np.vstack([CORRIDOR, [[30.0, 0.0, 30.0, 1.0], [30.0, 1.0, 30.0, 2.0]]])
    scan = [[-6.0, -0.8, 3.0, -0.8], [3.0, -0.8, 3.0, 0.1], [3.0, 1.2, -6.0, 1.2], [3.0, 0.3, 3.0, 1.2]]
    diagnostics = answer_of(index_of(walls), scan_of(scan)).diagnostics
    assert diagnostics is not None
    wall = diagnostics.critical_wall
    assert wall is not None
    assert (wall.scan, wall.map) == ((1, 3), (2, 3))
    assert np.abs(wall.direction) == pytest.approx([1.0, 0.0], abs=1e-3)
    assert wall.displacement > 1.0


def test_where_a_direction_is_free_it_is_named_instead_of_a_covariance() -> None:
    answer = replace(given_answer(), estimated=replace(given_answer().estimated, direction=(0.6, 0.8)))
    result = told(answer, replace(SURE, status=Status.DEGENERATE, usable=False, reasons=WHY))
    assert result.covariance is None
    assert result.unobservable == (0.6, 0.8)
    assert result.reasons == WHY
    result = told(answer, replace(SURE, status=Status.AMBIGUOUS, usable=False))
    assert result.covariance is not None
    assert result.unobservable is None


def test_no_match() -> None:
    """All that was found is an alternative, also what would have been the answer."""
    nothing = Verdict(Status.NO_MATCH, 0.01, False, pose(), None, None, WHY)
    context = context_of(ROOMS, SCAN)
    explanations = search_and_rank(context)
    for answer, status in ((explanations.answer, Status.NO_MATCH), (None, Status.OK)):
        result = report_of(context, replace(explanations, answer=answer), replace(nothing, status=status))
        assert (result.status, result.usable, result.probability) == (Status.NO_MATCH, False, 0.0)
        assert (result.pose, result.covariance, result.unobservable, result.diagnostics) == (None, None, None, None)
        assert (result.correspondences, result.missing_map) == ((), ())
        assert result.unmatched_scan == tuple(range(8))
        assert len(result.alternatives) == len(explanations.ranked) == 4
        assert result.search == explanations.search
        assert result.reasons == WHY


def test_walls_that_are_matched_are_not_missing() -> None:
    """Two screens stand before a wall that was seen; a segment on one of them is matched, and the other is missing."""
    screens = [[4.5, 0.5, 4.5, 2.2], [4.5, 2.4, 4.5, 3.6]]
    context = context_of(index_of(np.vstack([ROOM, screens])), SCAN)
    explanations = search_and_rank(context)
    answer = explanations.answer
    assert answer is not None
    verdict = judge(context, explanations)
    assert report_of(context, explanations, verdict).missing_map == (8, 9)
    pairs = answer.accepted.pairs.copy()
    pairs[0, 1] = 9
    on_screen = replace(answer, accepted=replace(answer.accepted, pairs=pairs))
    assert report_of(context, replace(explanations, answer=on_screen), verdict).missing_map == (8,)


def codes(endpoints: Floats, viewpoint: tuple[float, float] | None = (0.0, 0.0), **options: Any) -> dict[str, str]:
    """Return the warnings about a scan of the square room."""
    result = answer_of(index_of(SQUARE), scan_of(endpoints, viewpoint=viewpoint), **options)
    return {warning.code: warning.message for warning in result.warnings}


def test_segments_that_show_their_back_are_told() -> None:
    endpoints, _ = seen(SQUARE, pose(0.5, 0.3, 0.7))
    assert codes(endpoints) == {}
    endpoints[1] = endpoints[1][[2, 3, 0, 1]]
    assert list(codes(endpoints)) == ["faces_away"]
    assert codes(endpoints)["faces_away"].startswith("1 of 4 segments")
    assert codes(endpoints, oriented=False) == {}
    assert codes(endpoints, viewpoint=None) == {}


def test_a_segment_of_a_view_faces_the_sensor_of_that_view() -> None:
    """Segments without a viewpoint never face away."""
    room, pillar = SQUARE, np.array([[2.2, 3.0, 2.2, 2.0], [2.0, 2.0, 2.0, 3.0]])  # its faces to the right and left
    right, left = pose(4.0, 2.5), pose(1.0, 2.5)
    ends = [seen(np.vstack([room, face]), at)[0] for face, at in zip(pillar[:, None], (right, left), strict=True)]
    step = right.inverse().compose(left)

    def warned(*viewpoints: tuple[float, float] | None) -> list[str]:
        views = [View(scan_of(one, viewpoint=at)) for one, at in zip(ends, viewpoints, strict=True)]
        scan = assemble([views[0], replace(views[1], pose=step)])
        return [warning.code for warning in answer_of(index_of(room), scan).warnings]

    assert warned((0.0, 0.0), (0.0, 0.0)) == []
    assert warned((0.0, 0.0), None) == []
    ends[1] = ends[1][:, [2, 3, 0, 1]]
    assert warned((0.0, 0.0), (0.0, 0.0)) == ["faces_away"]


@pytest.mark.parametrize(("beside", "told"), [(0.04, False), (0.06, True)])
def test_a_wall_that_is_seen_along_itself_faces_nowhere(beside: float, told: bool) -> None:
    """The sensor stands `beside` its line, on the side that is not free."""
    endpoints, _ = seen(SQUARE, pose(1.0, 1.0))
    along = [2.0, beside, 4.0, beside]
    assert ("faces_away" in codes(np.vstack([endpoints, along]))) is told
    moved = np.vstack([endpoints, along]) + np.tile([-3.0, 0.5], 2)
    assert ("faces_away" in codes(moved, viewpoint=(-3.0, 0.5))) is told


def test_an_empty_scan_is_told() -> None:
    assert list(codes(np.zeros((0, 4)))) == ["no_segments"]


def test_what_the_verdict_and_the_search_say_is_told() -> None:
    context, answer = room(), given_answer()
    for contradicted, complete in ((False, True), (True, True), (False, False), (True, False)):
        explanations = explanations_of(answer, complete=complete)
        for status in (Status.OK, Status.NO_MATCH):
            vetoes = (BETTER_ELSEWHERE,) * contradicted + (INCOMPLETE,) * (not complete)
            verdict = replace(SURE, vetoes=vetoes, status=status)
            expected = ["prior_contradicted"] * contradicted + ["search_incomplete"] * (not complete)
            assert [w.code for w in report_of(context, explanations, verdict).warnings] == expected
