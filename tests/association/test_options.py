"""Options of a search: what they change, what they leave, and which values are rejected."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from association import INCLUDED, AssociationOptions, InvalidSearchError, Status
from registration import RegistrationOptions, Segments, register
from registration.options import Rotation

from .scenes import (
    INSIDE,
    ROOM,
    answer_of,
    drawn,
    drawn_room,
    equal_rooms,
    index_of,
    known,
    maze,
    pieces_of,
    pose,
    ranges,
    same_pose,
    scan_of,
    seen,
    without_beams,
)

SEEDS = st.integers(0, 10**6)
FEW = settings(max_examples=20, deadline=None, phases=[Phase.explicit, Phase.generate])
MAZE, MAZE_AT = index_of(maze(1)), pose(15.0, 14.0, 0.5)


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("max_alternatives", [0, 50], [-1, 51]),
        ("confidence", [0.5, 1.0], [0.49, 1.5, math.nan]),
        ("seed", [0, 2**63 - 1], [-1, 2**63]),
        ("offset_tolerance", [None, 1e-3, 0.4], [0.0, 0.41, 5.0, math.nan]),
        ("angle_tolerance", [None, 1e-3, 0.35], [0.0, 0.36, math.nan]),
        ("min_overlap", [0.0, 1.0], [-0.1, 1.1, math.nan]),
        ("on_map", [0.5, 1.0], [0.49, 1.01, math.nan]),
        ("usable_from", [0.5, 0.9999], [0.49, 1.0, math.nan]),
        ("include", [(), ("alternatives",)], [("segments",)]),
    ],
)
def test_options_have_a_range(name: str, good: list[Any], bad: list[Any]) -> None:
    for value in good:
        assert getattr(AssociationOptions(**{name: value}), name) == value
    for value in bad:
        with pytest.raises(InvalidSearchError) as refused:
            AssociationOptions(**{name: value})
        assert refused.value.argument == f"options.{name}"


def test_the_defaults_are_those_of_the_contract() -> None:
    options = AssociationOptions()
    assert (options.on_map, options.usable_from, options.confidence) == (0.9, 0.95, 0.9999)
    assert (options.max_alternatives, options.min_overlap, options.sampling) == (5, 0.5, "ordered")
    assert (options.exhaustive, options.oriented, options.estimator) == (False, True, "joint")


# --- The probability that decides -------------------------------------------------------------------------------------


def sent(seed: int) -> tuple[Any, Any]:
    """Draw a map and a scan: of a drawn room, or of pieces of walls, some of which leave doubts."""
    walls, scan = drawn(seed) if seed % 2 else pieces_of(seed)
    return index_of(walls), scan


@given(SEEDS)
@FEW
def test_the_probability_rises_with_the_prior_to_be_on_the_map(seed: int) -> None:
    index, scan = sent(seed)
    answers = [answer_of(index, scan, on_map=prior) for prior in (0.5, 0.7, 0.9, 0.97, 1.0)]
    found = [one.probability for one in answers if one.probability is not None]
    assert len(found) in (0, 5)
    assert all(low <= high + 1e-9 for low, high in itertools.pairwise(found))
    poses = [one.pose for one in answers if one.pose is not None]
    assert all(same_pose(one, poses[0], 1e-9, 1e-9) for one in poses)
    usable = [one.usable for one in answers]
    assert usable == sorted(usable)


def test_the_prior_to_be_on_the_map_changes_doubtful_answers() -> None:
    """Somewhere by a tenth, and its odds change by those of the prior at most."""
    changed, most = 0, math.log(0.99 / 0.01) - math.log(0.5 / 0.5)
    for seed in range(60):
        index, scan = sent(seed)
        one, other = (answer_of(index, scan, on_map=prior).probability for prior in (0.5, 0.99))
        if one is None or other is None or not 0.0 < one < other < 1.0:
            continue
        changed += other - one > 0.1
        assert math.log(other / (1.0 - other)) - math.log(one / (1.0 - one)) <= most + 1e-6
    assert changed >= 3


@given(SEEDS, st.floats(0.5, 0.9999), st.sampled_from([0.5, 0.9, 1.0]))
@FEW
def test_what_reaches_the_threshold_is_usable_unless_a_veto_applies(seed: int, least: float, on_map: float) -> None:
    index, scan = sent(seed)
    result = answer_of(index, scan, usable_from=least, on_map=on_map)
    reached = result.probability is not None and result.probability >= least
    assert result.search.complete
    vetoed = result.status in (Status.DEGENERATE, Status.NO_MATCH)
    assert result.usable == (reached and not vetoed)


def test_the_threshold_changes_nothing_else() -> None:
    """It is the status alone, with its reasons."""
    for seed in range(10):
        index, scan = sent(seed)
        one, other = (answer_of(index, scan, usable_from=least) for least in (0.5, 0.9999))
        for name in ("probability", "pose", "correspondences", "diagnostics", "search", "unmatched_scan"):
            assert getattr(one, name) == getattr(other, name), name


# --- The search -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(6))
def test_an_exhaustive_search_goes_through_all_bases_and_finds_the_same_pose(seed: int) -> None:
    at = pose(12.0 + seed, 15.0, 0.4 * seed)
    ends = seen(maze(1), at, noise=0.02, cut=0.5, seed=seed, radius=11.0)[0]
    short, whole = (answer_of(MAZE, scan_of(ends), exhaustive=exhaustive) for exhaustive in (False, True))
    assert (whole.search.exhaustive, whole.search.complete, whole.search.confidence) == (True, True, 1.0)
    assert whole.search.bases > short.search.bases
    assert known(short.diagnostics).score == pytest.approx(known(whole.diagnostics).score)
    assert same_pose(short.pose, whole.pose, 1e-9, 1e-9)


# A corner with a doorpost next to it, and what was seen of them.
CORNER_WITH_POST = np.array(
    [[23.0, 30.77, 23.0, 34.56], [23.0, 34.56, 19.78, 34.56], [21.93, 32.7, 21.64, 32.85], [21.64, 32.85, 21.79, 33.15]]
)
SEEN_OF_IT = np.array(
    [
        [1.553, -1.553, 2.053, -0.374],
        [1.165, -0.222, 0.806, 0.168],
        [0.788, 0.169, 0.989, 0.346],
        [1.01, 0.35, 0.55, 0.546],
    ]
)


@pytest.mark.parametrize("sigma", [0.0, 0.03, None])
@pytest.mark.parametrize("viewpoint", [None, (0.0, 0.0)])
def test_an_alternative_that_an_exhaustive_search_finds_is_found(
    sigma: float | None, viewpoint: tuple[float, float] | None
) -> None:
    """As long as it is above `complete_above`."""
    index, scan = index_of(CORNER_WITH_POST, sigma), scan_of(SEEN_OF_IT, viewpoint=viewpoint)
    usual, whole = (answer_of(index, scan, exhaustive=exhaustive) for exhaustive in (False, True))
    if (known(whole.diagnostics).runner_up or 0.0) > usual.search.complete_above:
        assert known(usual.diagnostics).runner_up == pytest.approx(known(whole.diagnostics).runner_up)
        assert usual.probability == pytest.approx(whole.probability)
    assert not usual.usable
    assert not whole.usable


def test_bases_may_be_drawn_at_random() -> None:
    """By a seed, which the report repeats; other seeds draw others, and find the same."""
    ends = seen(maze(1), MAZE_AT, noise=0.02, cut=0.4, clutter=14, seed=1, radius=9.0)[0]
    answers = [answer_of(MAZE, scan_of(ends), sampling="random", seed=seed) for seed in range(8)]
    again = answer_of(MAZE, scan_of(ends), sampling="random", seed=3)
    assert (again.search, again.pose) == (answers[3].search, answers[3].pose)
    assert [one.search.seed for one in answers] == list(range(8))
    assert {one.search.sampling for one in answers} == {"random"}
    assert len({(one.search.bases, one.search.hypotheses) for one in answers}) > 1
    assert all(same_pose(one.pose, MAZE_AT) and one.search.complete for one in answers)
    ordered = [answer_of(MAZE, scan_of(ends), seed=seed) for seed in (0, 5)]
    assert ordered[0].pose == ordered[1].pose
    assert (ordered[0].search.bases, ordered[0].search.hypotheses) == (
        ordered[1].search.bases,
        ordered[1].search.hypotheses,
    )


def test_more_confidence_takes_more_bases_and_is_reached() -> None:
    ends = seen(maze(1), MAZE_AT, noise=0.02, cut=0.4, clutter=20, seed=1, radius=9.0)[0]
    for sampling in ("ordered", "random"):
        answers = [answer_of(MAZE, scan_of(ends), confidence=p, sampling=sampling) for p in (0.5, 0.99, 0.999999)]
        found = [one.search for one in answers]
        assert [one.complete for one in found] == [True] * 3
        assert found[0].bases <= found[1].bases <= found[2].bases
        assert found[0].confidence >= 0.5
        assert found[1].confidence >= 0.98
    assert found[0].bases < found[2].bases


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(
    ("noise", "cut", "clutter", "radius"),
    [
        pytest.param(0.02, 0.5, 10, 9.0, id="walls seen in half, and a third of the segments from no wall"),
        pytest.param(0.01, 0.2, 48, 8.0, id="four fifths of clutter"),
    ],
)
def test_partial_noisy_walls_among_clutter(seed: int, noise: float, cut: float, clutter: int, radius: float) -> None:
    at = pose(12.0 + seed, 17.0 - seed, 1.1 * seed - 3.0)
    ends, truth = seen(maze(1), at, noise=noise, cut=cut, clutter=clutter, seed=seed, radius=radius)
    result = answer_of(MAZE, scan_of(ends))
    assert same_pose(result.pose, at)
    found = {pair.scan for pair in result.correspondences}
    assert sorted([*found, *result.unmatched_scan]) == list(range(len(truth)))
    assert len(found & set(np.nonzero(truth >= 0)[0].tolist())) >= 0.75 * (truth >= 0).sum()


# --- Gates ------------------------------------------------------------------------------------------------------------


def test_an_offset_tolerance_is_a_gate() -> None:
    ends, _ = seen(ROOM, INSIDE)
    along = (ends[0, 2:] - ends[0, :2]) / np.hypot(*(ends[0, 2:] - ends[0, :2]))
    ends[0] += 0.15 * np.tile([-along[1], along[0]], 2)
    for tolerance, count in ((0.3, len(ROOM)), (0.02, len(ROOM) - 1)):
        result = answer_of(index_of(ROOM), scan_of(ends), offset_tolerance=tolerance)
        assert len(result.correspondences) == count
        assert all(abs(pair.offset) < max(tolerance, 0.05) for pair in result.correspondences)


def test_an_angle_tolerance_is_a_gate() -> None:
    """A segment is turned by 7 degrees about its middle."""
    ends, _ = seen(ROOM, INSIDE)
    middle = 0.5 * (ends[3, :2] + ends[3, 2:])
    turn = pose(theta=math.radians(7.0))
    short = 0.2 * (ends[3].reshape(2, 2) - middle)
    ends[3] = (np.asarray(turn.apply(short)) + middle).ravel()
    for tolerance, count in ((0.3, len(ROOM)), (0.01, len(ROOM) - 1)):
        result = answer_of(index_of(ROOM), scan_of(ends), angle_tolerance=tolerance)
        assert len(result.correspondences) == count


def test_segments_may_have_to_lie_on_the_map_from_end_to_end() -> None:
    ends, _ = seen(ROOM, INSIDE)
    result = answer_of(index_of(ROOM), scan_of(ends), min_overlap=1.0)
    assert result.usable
    assert len(result.correspondences) == len(ends)
    longer = ends.copy()
    longer[0, :2] -= 0.6 * (ends[0, 2:] - ends[0, :2])  # sticks out by more than a third of its length
    for least, count in ((0.3, len(ROOM)), (0.9, len(ROOM) - 1)):
        result = answer_of(index_of(ROOM), scan_of(longer), min_overlap=least)
        assert len(result.correspondences) == count
        assert all(pair.overlap >= least for pair in result.correspondences)


# --- What is reported -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("most", [0, 2, 50])
def test_other_poses_come_best_first_and_no_more_than_requested(most: int) -> None:
    """Of eight equal rooms the last lacks a wall."""
    index = index_of(equal_rooms(8)[:-1])
    result = answer_of(index, scan_of(seen(ROOM, INSIDE, noise=0.02, seed=1)[0]), max_alternatives=most)
    assert len(result.alternatives) == min(most, 7)
    scores = [other.score for other in result.alternatives]
    assert scores == sorted(scores, reverse=True)
    rooms = {round((one.x - INSIDE.x) / 12.0) for one in [known(result.pose), *(a.pose for a in result.alternatives)]}
    assert len(rooms) == 1 + min(most, 7)
    if most == 50:
        assert round((result.alternatives[-1].pose.x - 3.0) / 12.0) == 7
        worst = result.alternatives[-1]
        assert worst.inlier_fraction < result.alternatives[0].inlier_fraction
        assert 0.0 <= known(worst.probability) < 0.5 * known(result.probability)


@pytest.mark.parametrize("parts", [(), ("correspondences",), ("missing_map",), ("alternatives", "missing_map")])
def test_parts_that_are_left_out_are_empty_and_change_nothing_else(parts: tuple[Any, ...]) -> None:
    """Of a usable answer with an alternative, and a wall through which it sees."""
    walls = np.vstack([ROOM, ROOM[:6] + np.tile([12.0, 0.0], 2), [[4.0, 3.3, 5.0, 3.4]]])
    sent = scan_of(seen(ROOM, INSIDE, noise=0.01, seed=1)[0], viewpoint=(0.0, 0.0))
    index = index_of(walls)
    whole, part = (answer_of(index, sent, on_map=1.0, usable_from=0.5, include=which) for which in (INCLUDED, parts))
    assert whole.usable
    for one in INCLUDED:
        assert getattr(whole, one), one
        assert bool(getattr(part, one)) == (one in parts), one
    for name in ("status", "usable", "probability", "pose", "unmatched_scan", "diagnostics", "reasons", "search"):
        assert getattr(part, name) == getattr(whole, name), name


def test_an_answer_that_is_not_usable_has_its_other_poses() -> None:
    """They are counted in the message, whatever the parts are."""
    result = answer_of(index_of(equal_rooms(3)), scan_of(seen(ROOM, INSIDE)[0]), include=())
    assert not result.usable
    assert len(result.alternatives) == 2


# --- The paper's estimator --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("clutter", [0, 3])
def test_usable_always_comes_from_the_joint_sums(clutter: int) -> None:
    """So does the score."""
    scan = scan_of(seen(ROOM, INSIDE, noise=0.03, cut=0.4, clutter=clutter, seed=1)[0], 0.03)
    for walls in (ROOM, equal_rooms(2)):
        joint, one_step = (answer_of(index_of(walls), scan, estimator=name) for name in ("joint", "one_step"))
        assert known(one_step.diagnostics).score == known(joint.diagnostics).score
        for name in ("status", "usable", "probability", "reasons"):
            assert getattr(joint, name) == getattr(one_step, name)
        assert known(joint.diagnostics).margin == known(one_step.diagnostics).margin


@pytest.mark.parametrize("rotation", ["wahba", "mitsuta"])
def test_one_step_is_the_paper_s_pose_of_its_pairs(rotation: Rotation) -> None:
    """That of the public estimator with the same pairs and weights, and no other."""
    scan = scan_of(seen(ROOM, INSIDE, noise=0.02, seed=1)[0])
    result = answer_of(index_of(ROOM, 0.0), scan, estimator="one_step", rotation=rotation)
    weights, pairs = zip(*((one.weight, [one.scan, one.map]) for one in result.correspondences), strict=True)
    for name in ("wahba", "mitsuta"):
        how = RegistrationOptions("one_step", name, weights=weights)
        found = register(Segments.from_array(ROOM), scan.measured, pairs, 0.0, how).pose
        assert same_pose(found, result.pose, 1e-9, 1e-9) == (name == rotation)
    assert result.covariance is None


def test_ranges_and_segments_of_ordinary_rooms_are_usable() -> None:
    """By default, and with no clutter: what all other options are compared with."""
    results = []
    for k in range(20):
        room, at = drawn_room(np.random.default_rng([9, k]))
        scan = ranges(room, at, k)
        results += [answer_of(index_of(room), one) for one in (scan, without_beams(scan))]
        assert all(same_pose(one.pose, at, 0.03, 0.01) for one in results[-2:])
    assert sum(one.usable for one in results) >= 38
