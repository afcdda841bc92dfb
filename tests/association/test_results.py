"""The parts of an answer agree with one another, in every kind of answer; warnings, messages and explanations."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, replace
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from association import (
    AssociationOptions,
    AssociationResult,
    AssociationWarning,
    Beams,
    HardPrior,
    MapIndex,
    Prior,
    ReasonCode,
    Scan,
    SoftPrior,
    Status,
    View,
    WarningCode,
    assemble,
    associate,
    explain_verdict,
)

from .scenes import (
    CORRIDOR,
    INSIDE,
    LOBBY,
    ROOM,
    SQUARE,
    Floats,
    answer_of,
    as_json,
    carried,
    drawn,
    drawn_room,
    equal_rooms,
    index_of,
    known,
    maze,
    pieces_of,
    pose,
    ranges,
    reason_codes,
    same_pose,
    scan_of,
    seen,
    warning_codes,
)

SEEDS = st.integers(0, 10**6)
FEW = settings(max_examples=40, deadline=None, phases=[Phase.explicit, Phase.generate])
ROOM_INDEX = index_of(ROOM)


def drawn_question(seed: int) -> tuple[MapIndex, Scan, Prior | None]:
    """Draw a question of any kind: in a map or out of it, with a prior or without."""
    walls, scan = drawn(seed) if seed % 2 else pieces_of(seed)
    if seed % 7 == 0:
        walls = LOBBY + 3.0
    rng = np.random.default_rng(seed)
    near = pose(rng.uniform(0.0, 12.0), rng.uniform(0.0, 12.0), rng.uniform(-3.0, 3.0))
    prior: Prior | None = None
    if seed % 5 == 1:
        prior = HardPrior(near, 3.0, 2.0)
    if seed % 5 == 2:
        prior = SoftPrior(near, np.diag([4.0, 4.0, 1.0]))
    return index_of(walls, (None, 0.0, 0.02)[seed % 3]), scan, prior


def assert_consistent(result: AssociationResult, scan: Scan, index: MapIndex, prior: Prior | None) -> None:
    """Check what holds of every answer."""
    status, diagnostics = result.status, result.diagnostics
    assert result.usable == (status is Status.OK)
    assert bool(result.reasons) != result.usable
    assert set(reason_codes(result)) <= set(get_args(ReasonCode))
    assert set(warning_codes(result)) <= set(get_args(WarningCode))
    assert len(set(reason_codes(result))) == len(result.reasons)
    assert (result.pose is None) == (status is Status.NO_MATCH)
    assert (result.probability is None) == (status is Status.DEGENERATE)
    assert result.probability is None or 0.0 <= result.probability <= 1.0
    if status in (Status.NO_MATCH, Status.DEGENERATE):
        assert result.covariance is None
    else:
        assert result.covariance is not None
        assert np.linalg.eigvalsh(result.covariance).min() > 0.0
        np.testing.assert_allclose(result.covariance, result.covariance.T)
    assert (result.unobservable is not None) <= (status is Status.DEGENERATE)
    matched = [pair.scan for pair in result.correspondences]
    assert matched == sorted(set(matched))
    assert sorted([*matched, *result.unmatched_scan]) == list(range(len(scan.measured)))
    for pair in result.correspondences:
        assert 0 <= pair.map < len(index.segments)
        assert pair.map not in pair.alternatives
        assert 0.0 <= pair.overlap <= 1.0 + 1e-9
        assert pair.weight > 0.0
    assert not set(result.missing_map) & {pair.map for pair in result.correspondences}
    scores = [one.score for one in result.alternatives]
    assert prior is not None or scores == sorted(scores, reverse=True)
    assert len(scores) <= 5
    places = [one.pose for one in result.alternatives] + ([] if result.pose is None else [result.pose])
    for k, one in enumerate(places):
        assert not any(same_pose(one, other, 0.05, 0.02) for other in places[:k])
    if result.probability is not None:
        assert result.probability + sum(one.probability or 0.0 for one in result.alternatives) <= 1.0 + 1e-9
    if diagnostics is None:
        assert status is Status.NO_MATCH
        return
    assert (diagnostics.margin is None) == (diagnostics.runner_up is None)
    assert diagnostics.margin is None or diagnostics.margin >= 0.0
    assert diagnostics.runner_up is None or diagnostics.runner_up >= 0.0
    assert 0.0 <= diagnostics.inlier_fraction <= 1.0 + 1e-9
    assert diagnostics.pairs == len(result.correspondences)
    if diagnostics.critical_wall is not None:
        wall = diagnostics.critical_wall
        assert set(wall.scan) <= set(matched)
        assert np.hypot(*wall.direction) == pytest.approx(1.0)
        assert wall.displacement > 0.0
    assert result.message
    assert json.dumps(asdict(result), default=lambda array: array.tolist(), allow_nan=False), "all numbers are finite"


@given(SEEDS)
@FEW
def test_the_parts_of_an_answer_agree(seed: int) -> None:
    index, scan, prior = drawn_question(seed)
    assert_consistent(answer_of(index, scan, prior), scan, index, prior)


def test_questions_of_all_kinds_are_drawn() -> None:
    """So that the test above means something."""
    statuses = {answer_of(*drawn_question(seed)).status for seed in range(40)}
    assert statuses == set(Status)


# --- Messages ---------------------------------------------------------------------------------------------------------


# --- The critical wall ------------------------------------------------------------------------------------------------


def test_at_a_corridors_end_that_wall_is_critical() -> None:
    """It was seen in two pieces, and is drawn in two; without it the place along the corridor is not fixed."""
    walls = np.vstack([CORRIDOR, [[30.0, 0.0, 30.0, 1.0], [30.0, 1.0, 30.0, 2.0]]])
    ends = [[-6.0, -0.8, 3.0, -0.8], [3.0, -0.8, 3.0, 0.1], [3.0, 1.2, -6.0, 1.2], [3.0, 0.3, 3.0, 1.2]]
    diagnostics = known(answer_of(index_of(walls), scan_of(ends)).diagnostics)
    wall = diagnostics.critical_wall
    assert wall is not None
    assert (wall.scan, wall.map) == ((1, 3), (2, 3))
    assert np.abs(wall.direction) == pytest.approx([1.0, 0.0], abs=1e-3)
    assert wall.displacement > 1.0


def test_where_many_walls_hold_the_pose_none_is_critical() -> None:
    for seed in range(5):
        ends = seen(maze(1), pose(15.0, 14.0, 0.5), noise=0.01, seed=seed, radius=12.0)[0]
        diagnostics = known(answer_of(index_of(maze(1)), scan_of(ends)).diagnostics)
        assert diagnostics.critical_wall is None


def test_an_alternative_with_an_unobservable_direction_has_no_covariance() -> None:
    """The scan of a corridor's end, which the middle of another corridor explains in part."""
    walls = np.vstack([CORRIDOR, [[30.0, 0.0, 30.0, 2.0]], CORRIDOR + np.tile([0.0, 20.0], 2)])
    ends = [[-6.0, -0.8, 3.0, -0.8], [3.0, 1.2, -6.0, 1.2], [3.0, -0.8, 3.0, 1.2]]
    result = answer_of(index_of(walls), scan_of(ends))
    assert result.covariance is not None
    other = next(one for one in result.alternatives if abs(one.pose.y - 20.8) < 0.1)
    assert other.covariance is None


def test_walls_that_are_matched_are_not_missing() -> None:
    """Two screens stand before a wall that was seen; where one of them was seen, the other alone is missing."""
    screens = np.array([[4.5, 0.5, 4.5, 2.2], [4.5, 2.4, 4.5, 3.6]])
    index, ends = index_of(np.vstack([ROOM, screens])), seen(ROOM, INSIDE)[0]
    assert answer_of(index, scan_of(ends, viewpoint=(0.0, 0.0))).missing_map == (8, 9)
    on_screen = np.vstack([ends, carried(screens[1:], INSIDE.inverse())])
    assert answer_of(index, scan_of(on_screen, viewpoint=(0.0, 0.0))).missing_map == (8,)


# --- Warnings ---------------------------------------------------------------------------------------------------------


def codes(scan: Scan, index: MapIndex = ROOM_INDEX, **options: Any) -> list[str]:
    return warning_codes(answer_of(index, scan, **options))


def test_an_ordinary_scan_has_no_warning_and_one_of_nothing_has() -> None:
    for k in range(5):
        room, at = drawn_room(np.random.default_rng([14, k]))
        assert codes(ranges(room, at, k), index_of(room)) == []
    assert codes(scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0))) == []
    assert codes(scan_of(np.zeros((0, 4)))) == ["no_segments"]


def test_points_that_are_not_in_order_and_warnings_of_the_scan_are_passed_on() -> None:
    scan = scan_of(seen(ROOM, INSIDE)[0])
    assert "points_not_in_order" in codes(replace(scan, ordered=False))
    known = AssociationWarning("nulls_for_no_return", "a message")
    assert known in answer_of(ROOM_INDEX, replace(scan, warnings=(known,))).warnings
    views = [View(replace(scan, warnings=(known,))), View(scan, pose(0.1))]
    assert assemble(views).warnings == (known,)


ANGLES = np.linspace(-math.pi, math.pi, 240, endpoint=False)


def beams_with(stuck: int, value: float, returns: int) -> Beams:
    """Return ranges of which so many have one value, and beams without return."""
    found = np.full(240, math.inf)
    found[:returns] = np.linspace(2.0, 6.0, returns)
    found[:stuck] = value
    return Beams(ANGLES, found, 30.0)


@pytest.mark.parametrize(
    ("stuck", "value", "returns", "warned"),
    [(20, 7.5, 40, True), (19, 7.5, 40, False), (30, 0.05, 40, True), (9, 7.5, 9, False), (10, 7.5, 10, True)],
)
def test_ten_equal_returns_have_a_warning_if_they_are_half(
    stuck: int, value: float, returns: int, warned: bool
) -> None:
    beams = beams_with(stuck, value, returns)
    result = answer_of(ROOM_INDEX, scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0), beams=beams))
    messages = [one.message for one in result.warnings if one.code == "stuck_ranges"]
    assert bool(messages) == warned
    assert not warned or messages[0].startswith(f"{stuck} of {returns} ranges are exactly {value} m")


@pytest.mark.parametrize(("factor", "warned"), [(1.0, False), (1.08, False), (1.2, True), (3.28, True), (1e3, True)])
def test_a_scan_larger_than_the_map_has_a_warning(factor: float, warned: bool) -> None:
    """All of a room is seen, corner to corner."""
    answer = answer_of(ROOM_INDEX, scan_of(factor * seen(ROOM, INSIDE)[0]))
    messages = [one.message for one in answer.warnings if one.code == "scan_exceeds_map"]
    assert bool(messages) == warned
    if factor == 1e3:
        assert "the scan seems to be in millimetres" in messages[0]
        assert "its unit may be wrong" in answer.message


def test_a_map_in_millimetres_is_named() -> None:
    assert "unlikely_map_size" in codes(scan_of(seen(ROOM, INSIDE)[0]), index_of(1000.0 * ROOM))


def test_a_segment_seen_through_a_window_does_not_make_a_scan_large() -> None:
    ends = seen(ROOM, INSIDE)[0]
    assert "scan_exceeds_map" not in codes(scan_of(np.vstack([ends, [[60.0, 0.0, 60.0, 1.5]]])))
    assert "scan_exceeds_map" in codes(scan_of(np.vstack([ends, [[60.0, -20.0, 60.0, 20.0]]])))


def facing(ends: Floats, viewpoint: tuple[float, float] | None = (0.0, 0.0), **options: Any) -> list[str]:
    """Return the messages about segments of a scan of the square room that face away."""
    result = answer_of(index_of(SQUARE), scan_of(ends, viewpoint=viewpoint), **options)
    return [one.message for one in result.warnings if one.code == "faces_away"]


def test_segments_that_face_away_have_a_warning() -> None:
    ends = seen(SQUARE, pose(0.5, 0.3, 0.7))[0]
    assert facing(ends) == []
    ends[1] = ends[1][[2, 3, 0, 1]]
    [message] = facing(ends)
    assert message.startswith("1 of 4 segments")
    assert facing(ends, oriented=False) == []
    assert facing(ends, viewpoint=None) == []
    # A wall that is seen along itself faces nowhere.
    straight = seen(SQUARE, pose(1.0, 1.0))[0]
    for aside, warned in ((0.04, False), (0.06, True)):
        for shift in (0.0, -3.0):
            along = np.vstack([straight, [2.0, aside, 4.0, aside]]) + shift
            assert bool(facing(along, viewpoint=(shift, shift))) is warned


def test_a_segment_of_a_view_faces_the_sensor_of_that_view() -> None:
    """Segments without a viewpoint never face away."""
    room, pillar = SQUARE, np.array([[2.2, 3.0, 2.2, 2.0], [2.0, 2.0, 2.0, 3.0]])  # its faces to the right and left
    right, left = pose(4.0, 2.5), pose(1.0, 2.5)
    ends = [seen(np.vstack([room, face]), at)[0] for face, at in zip(pillar[:, None], (right, left), strict=True)]
    step = right.inverse().compose(left)

    def warned(*viewpoints: tuple[float, float] | None) -> bool:
        views = [View(scan_of(one, viewpoint=at)) for one, at in zip(ends, viewpoints, strict=True)]
        return "faces_away" in codes(assemble([views[0], replace(views[1], pose=step)]), index_of(room))

    assert not warned((0.0, 0.0), (0.0, 0.0))
    assert not warned((0.0, 0.0), None)
    ends[1] = ends[1][:, [2, 3, 0, 1]]
    assert warned((0.0, 0.0), (0.0, 0.0))


# --- Explanations -----------------------------------------------------------------------------------------------------


def test_an_explanation_is_that_of_the_answer_by_its_vetoes_and_the_probability_alone() -> None:
    vetoed = 0
    for seed in range(12):
        index, scan, prior = drawn_question(seed)
        options = AssociationOptions(usable_from=0.9)
        found, answer = explain_verdict(index, scan, prior, options), associate(index, scan, prior, options)
        assert as_json(found.result) == as_json(answer)
        for name in ("status", "usable", "probability", "reasons"):
            assert getattr(found.verdict, name) == getattr(answer, name)
        applied = any(veto.applies for veto in found.verdict.vetoes)
        vetoed += applied
        if answer.usable or (not applied and answer.probability is not None):
            assert not applied
            assert ((answer.probability or 0.0) >= 0.9) == answer.usable
    assert vetoed > 0


def test_an_explanation_of_equal_rooms_weighs_the_alternative() -> None:
    verdict = explain_verdict(index_of(equal_rooms(2)), scan_of(seen(ROOM, INSIDE, noise=0.01, seed=1)[0])).verdict
    (other,) = verdict.alternatives
    assert other.weight == pytest.approx(1.0, abs=0.05)
    assert same_pose(other.pose, pose(INSIDE.x + 12.0, INSIDE.y, INSIDE.theta)) or same_pose(other.pose, INSIDE)
