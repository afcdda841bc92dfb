"""What a caller gets is what was found and concluded, in the map frame and by the caller's own indices."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from association import AssociationResult, Status
from association.acceptance import Accepted
from association.explain import Answer, explain
from association.report import report
from association.verdict import Verdict, judge
from registration import RigidTransform
from registration.layout import Floats

from .answers import ROOM_INDEX, SCAN, SHARP, answer_with, deviating, explanations_of, ranked, registered_room, room
from .scenes import INSIDE, ROOM, SQUARE, answer_of, context_of, index_of, pose, scan_of, seen

SURE = Verdict(Status.OK, 0.97, True, pose(1.0, 2.0, 0.3), 20.0, 0.75, False)
OTHERS = [
    ranked(60.0 - k, at=pose(float(k), 0.5, 0.1), covariance=(k + 1.0) * SHARP, share=0.1 * k, reliability=0.2 * k)
    for k in range(4)
]


def given_answer() -> Answer:
    """Return an answer of the first three segments of the scan."""
    pairs, overlaps = np.array([[0, 4], [1, 9], [2, 2]]), np.array([0.9, 0.8, 0.7])
    accepted = Accepted(pairs, overlaps, np.array([6, 7, 15]), np.array([0, 2, 2, 3]))
    offsets, angles, weights = np.array([0.01, 0.02, 0.03]), np.array([0.1, 0.2, 0.3]), np.array([5.0, 6.0, 7.0])
    registered = replace(registered_room(), offsets=offsets, angles=angles, weights=weights)
    return answer_with(ranked(80.0, -2.0, share=0.6), registered, accepted=accepted, significance=1e-5)


def told(answer: Answer | None, verdict: Verdict = SURE, **options: Any) -> AssociationResult:
    """Report an answer beside four others."""
    context = context_of(ROOM_INDEX, SCAN, **options)
    return report(context, explanations_of(answer, *OTHERS), verdict)


def test_what_is_found_and_concluded_is_told() -> None:
    result, registered = told(given_answer()), registered_room()
    assert (result.status, result.usable, result.probability, result.pose) == (Status.OK, True, 0.97, SURE.pose)
    assert result.unobservable is None
    assert registered.covariance is not None
    np.testing.assert_array_equal(result.covariance, registered.covariance)
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
    assert got == [
        (0, 4, 0.9, 0.01, 0.1, 5.0, (6, 7)),
        (1, 1, 0.8, 0.02, 0.2, 6.0, ()),
        (2, 2, 0.7, 0.03, 0.3, 7.0, (7,)),
    ]
    assert result.unmatched_scan == (3, 4, 5, 6, 7)


@pytest.mark.parametrize("most", [0, 2, 50])
def test_other_poses_best_first(most: int) -> None:
    x, y = ROOM_INDEX.origin
    alternatives = told(given_answer(), max_alternatives=most).alternatives
    assert len(alternatives) == min(most, 4)
    for k, other in enumerate(alternatives):
        assert other.pose == RigidTransform(k + x, 0.5 + y, 0.1)
        assert (other.score, other.inlier_fraction, other.reliability) == (60.0 - k, 0.1 * k, 0.2 * k)
        assert other.covariance is not None
        np.testing.assert_allclose(other.covariance, (k + 1.0) * SHARP)


def test_where_a_direction_is_free_it_is_named_instead_of_a_covariance() -> None:
    answer = replace(given_answer(), registered=replace(deviating(0.6, 0.1), offsets=np.zeros(3)))
    result = told(answer, replace(SURE, status=Status.DEGENERATE, usable=False))
    assert result.covariance is None
    assert result.unobservable == (1.0, 0.0)
    result = told(answer, replace(SURE, status=Status.AMBIGUOUS, usable=False))
    assert result.covariance is not None
    assert result.unobservable is None


def test_no_match() -> None:
    """All that was found is an alternative, also what would have been the answer."""
    nothing = Verdict(Status.NO_MATCH, 0.01, False, pose(), None, None, False)
    for answer, alternatives in ((given_answer(), 5), (None, 4)):
        result = told(answer, nothing)
        assert (result.status, result.usable, result.probability) == (Status.NO_MATCH, False, 0.0)
        assert (result.pose, result.covariance, result.unobservable, result.diagnostics) == (None, None, None, None)
        assert (result.correspondences, result.missing_map) == ((), ())
        assert result.unmatched_scan == tuple(range(8))
        assert len(result.alternatives) == alternatives
        assert result.search == explanations_of(None).search
    assert told(None, replace(nothing, status=Status.OK)).status is Status.NO_MATCH


def covariance_of(chi2: float, dof: int, *, usable: bool) -> Floats:
    diagnostics = replace(registered_room().diagnostics, chi2=chi2, dof=dof)
    answer = given_answer()
    registered = replace(answer.registered, diagnostics=diagnostics, covariance=SHARP, usable=usable)
    result = told(replace(answer, registered=registered))
    assert result.covariance is not None
    return result.covariance


def test_residuals_beyond_the_sigmas_widen_the_covariance() -> None:
    """By chi2 over its degrees of freedom, where registration does not call its own answer usable."""
    np.testing.assert_allclose(covariance_of(60.0, 12, usable=False), 5.0 * SHARP)
    np.testing.assert_allclose(covariance_of(60.0, 12, usable=True), SHARP)
    np.testing.assert_allclose(covariance_of(6.0, 12, usable=False), SHARP)
    np.testing.assert_allclose(covariance_of(3.0, 0, usable=False), 3.0 * SHARP)
    answer = replace(given_answer(), registered=replace(given_answer().registered, covariance=None))
    assert told(answer).covariance is None


def test_a_trusting_sigma_has_the_covariance_of_the_fair_one() -> None:
    endpoints, _ = seen(ROOM, INSIDE, noise=0.03, seed=5)
    trusting = answer_of(ROOM_INDEX, scan_of(endpoints, 1e-3))
    assert trusting.diagnostics is not None
    chi2, dof = trusting.diagnostics.registration.chi2, trusting.diagnostics.registration.dof
    assert chi2 > 10 * dof
    fair = answer_of(ROOM_INDEX, scan_of(endpoints, 1e-3 * (chi2 / dof) ** 0.5))
    assert trusting.covariance is not None
    assert fair.covariance is not None
    np.testing.assert_allclose(trusting.covariance, fair.covariance, rtol=0.05, atol=1e-7)


def test_walls_that_are_matched_are_not_missing() -> None:
    """Two screens stand before a wall that was seen; a segment on one of them is matched, and the other is missing."""
    screens = [[4.5, 0.5, 4.5, 2.2], [4.5, 2.4, 4.5, 3.6]]
    context = context_of(index_of(np.vstack([ROOM, screens])), SCAN)
    explanations = explain(context)
    answer = explanations.answer
    assert answer is not None
    verdict = judge(context, explanations)
    assert report(context, explanations, verdict).missing_map == (8, 9)
    pairs = answer.accepted.pairs.copy()
    pairs[0, 1] = 9
    on_screen = replace(answer, accepted=replace(answer.accepted, pairs=pairs))
    assert report(context, replace(explanations, answer=on_screen), verdict).missing_map == (8,)


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
            verdict = replace(SURE, contradicted=contradicted, status=status)
            expected = ["prior_contradicted"] * contradicted + ["search_incomplete"] * (not complete)
            assert [w.code for w in report(context, explanations, verdict).warnings] == expected
