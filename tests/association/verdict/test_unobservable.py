"""When an answer is one of many along a direction, and which of them is given."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from association import HardPrior, MapIndex, SoftPrior
from association.consensus.estimation import EstimatedPose
from association.rank_and_estimate import search_and_rank
from association.verdict.tuning import MOST_BEYOND
from association.verdict.unobservable import beyond_tolerance, choose_along_direction
from association.verdict.verdict import judge
from registration import RigidTransform
from registration.layout import Floats

from ..answers import answer_with, estimated_of, explanations_of, ranked, registered_room, room
from ..judged import PLAIN, judged_by
from ..scenes import INSIDE, context_of, index_of, pose, scan_of


@pytest.mark.parametrize(
    ("weakest", "parallel", "degenerate"),
    [(0.49, False, False), (0.51, False, True), (0.01, False, False), (0.01, True, True), (0.51, True, True)],
)
def test_a_position_is_fixed_to_half_a_metre(weakest: float, parallel: bool, degenerate: bool) -> None:
    """Along its weakest direction; and by walls that are not all parallel."""
    assert replace(estimated_of(registered_room()), weakest=weakest, parallel=parallel).degenerate is degenerate


def estimated_on(walls: Floats, seen_walls: Floats) -> EstimatedPose:
    """Search, and return the answer worked out."""
    answer = search_and_rank(context_of(index_of(walls), scan_of(seen_walls))).answer
    assert answer is not None
    return answer.estimated


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.5, math.pi / 2, 2.0, 3.1])
def test_the_direction_that_is_not_fixed(angle: float) -> None:
    """That along parallel walls; of the two opposite ones that to the right, or straight up."""
    by = RigidTransform(7.0, -3.0, angle)
    estimated = estimated_on(by.apply(WALLS.reshape(-1, 2, 2)).reshape(-1, 4), SEEN)
    assert estimated.parallel
    assert estimated.degenerate
    d = np.array([math.cos(angle), math.sin(angle)])
    expected = d if d[0] > 1e-9 or (abs(d[0]) < 1e-9 and d[1] > 0.0) else -d
    assert abs(estimated.direction[0] * d[1] - estimated.direction[1] * d[0]) < 1e-6
    assert estimated.direction == pytest.approx(expected.tolist(), abs=1e-6) or abs(d[0]) < 1e-9


@pytest.mark.parametrize(
    ("degrees", "degenerate"), [(0.0, True), (1.0, True), (2.0, True), (45.0, False), (90.0, False)]
)
def test_two_walls_that_are_nearly_parallel_fix_no_position(degrees: float, degenerate: bool) -> None:
    """Walls are off by centimetres, which such walls turn into metres along them."""
    turn = math.radians(degrees)
    second = [20.0, 4.0, 20.0 - 15.0 * math.cos(turn), 4.0 - 15.0 * math.sin(turn)]
    walls = np.array([[0.0, 0.0, 30.0, 0.0], second])
    seen_walls = np.array(
        [[-6.0, -2.0, 6.0, -2.0], [6.0, 2.0, 6.0 - 12.0 * math.cos(turn), 2.0 - 12.0 * math.sin(turn)]]
    )
    assert estimated_on(walls, seen_walls).degenerate is degenerate


def placed(index: MapIndex, endpoints: Floats, prior: SoftPrior | HardPrior | None = None) -> RigidTransform:
    """Search, and return the member of the family that is answered."""
    context = context_of(index, scan_of(endpoints), prior)
    answer = search_and_rank(context).answer
    assert answer is not None
    assert answer.estimated.degenerate
    found = choose_along_direction(context, answer)
    assert found is not None
    return found


# Three walls, the second one 10 m farther on than the first; seen 0.8 m next to the first as 2 or 3 m of each.
WALLS = np.array([[0.0, 0.0, 30.0, 0.0], [40.0, 2.0, 10.0, 2.0], [12.0, 5.0, 28.0, 5.0]])
SEEN = np.array([[-1.0, -0.8, 2.0, -0.8], [6.0, 1.2, 4.0, 1.2], [1.0, 4.2, 3.0, 4.2]])


@pytest.mark.parametrize("turn", [0.0, 0.7, -2.5])
def test_of_a_family_the_middle_of_what_was_seen_is_centred_on_its_walls(turn: float) -> None:
    """They reach from 0 to 40 m, what was seen from -1 to 6 m about the sensor: it stands 2.5 m before their middle."""
    by = RigidTransform(300.0, -200.0, turn)
    index = index_of(by.apply(WALLS.reshape(-1, 2, 2)).reshape(-1, 4))
    elsewhere = RigidTransform(1.0, 2.0, 0.4)  # the sensor's frame
    endpoints = elsewhere.apply(SEEN.reshape(-1, 2, 2)).reshape(-1, 4)
    found = by.inverse().compose(placed(index, endpoints)).compose(elsewhere)
    assert (found.x, found.y, found.theta) == pytest.approx((20.0 - 2.5, 0.8, 0.0), abs=1e-6)


def test_what_was_not_matched_does_not_count() -> None:
    """Neither of the scan nor of the map."""
    walls = np.vstack([WALLS, [[-50.0, 9.0, -60.0, 5.0]]])
    clutter = [9.0, 0.0, 9.5, 0.6]
    found = placed(index_of(walls), np.vstack([clutter, SEEN]))
    assert (found.x, found.y) == pytest.approx((17.5, 0.8), abs=1e-6)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_of_a_family_the_member_nearest_the_prior(turn: float) -> None:
    by = RigidTransform(300.0, -200.0, turn)
    index = index_of(by.apply(WALLS.reshape(-1, 2, 2)).reshape(-1, 4))
    known = by.compose(pose(12.0, 0.5, 0.02))
    for prior in (SoftPrior(known, np.diag([4.0, 4.0, 0.1])), HardPrior(known, 3.0, 0.5)):
        found = by.inverse().compose(placed(index, SEEN, prior))
        assert (found.x, found.y, found.theta) == pytest.approx((12.0, 0.8, 0.0), abs=1e-6)


def test_of_a_family_the_member_at_which_the_beams_fit_best() -> None:
    """It is where the best explanation lies, along the direction that is free."""
    context = room(with_beams=True)
    free = replace(estimated_of(registered_room()), direction=(0.6, 0.8), free=True)
    best = ranked(at=pose(1.0, -0.5, 0.7))  # of the index frame
    found = choose_along_direction(context, answer_with(best, estimated=free))
    assert found is not None
    x, y = context.index.origin
    away = 0.6 * (1.0 + x - INSIDE.x) + 0.8 * (-0.5 + y - INSIDE.y)
    assert (found.x, found.y) == pytest.approx((INSIDE.x + 0.6 * away, INSIDE.y + 0.8 * away))
    assert found.theta == pytest.approx(INSIDE.theta)
    known = SoftPrior(pose(4.0, 2.5, 0.0), np.eye(3))
    found = choose_along_direction(room(with_beams=True, prior=known), answer_with(best, estimated=free))
    assert found is not None
    assert (found.x, found.y) == pytest.approx((INSIDE.x + 0.6 * 0.6, INSIDE.y + 0.6 * 0.8)), "a prior goes before"


def test_without_a_pose_there_is_no_family() -> None:
    assert choose_along_direction(room(), answer_with(ranked(), replace(registered_room(), pose=None))) is None


@pytest.mark.parametrize(
    ("deviations", "probability"),
    [
        ((0.01, 0.02, 0.001), 0.0),
        ((0.01, 0.15306, 0.001), 0.05),  # 0.3 m are 1.96 standard deviations
        ((0.01, 0.02, math.radians(1.5306)), 0.05),
        ((0.15306, 0.02, math.radians(1.5306)), 1.0 - 0.95**2),
    ],
)
def test_the_probability_of_an_error_beyond_the_tolerance(
    deviations: tuple[float, float, float], probability: float
) -> None:
    estimated = replace(estimated_of(registered_room()), covariance=np.diag(np.square(deviations)))
    assert beyond_tolerance(room(), answer_with(ranked(), estimated=estimated)) == pytest.approx(probability, abs=1e-4)


def test_the_weakest_direction_counts_whatever_the_axes_are() -> None:
    spread = np.diag([0.2**2, 0.01**2, 1e-6])
    rotation = np.eye(3)
    rotation[:2, :2] = [[math.cos(0.7), -math.sin(0.7)], [math.sin(0.7), math.cos(0.7)]]
    plain, leaning = (
        beyond_tolerance(
            room(), answer_with(ranked(), estimated=replace(estimated_of(registered_room()), covariance=one))
        )
        for one in (spread, rotation @ spread @ rotation.T)
    )
    assert leaning == pytest.approx(plain)
    assert plain > MOST_BEYOND


@pytest.mark.parametrize(("degrees", "usable"), [(1.4, True), (1.7, False)])
def test_a_heading_that_is_known_too_roughly_is_not_usable(degrees: float, usable: bool) -> None:
    covariance = np.diag(np.square([0.02, 0.02, math.radians(degrees)]))
    answer = answer_with(ranked(), estimated=replace(estimated_of(registered_room()), covariance=covariance))
    with judged_by({name: {"constant": [30.0]} for name in PLAIN}):
        verdict = judge(room(), explanations_of(answer))
    assert verdict.usable is usable
    assert [veto.name for veto in verdict.vetoes] == ([] if usable else ["imprecise"])
    if not usable:
        assert "3 degrees" in verdict.reasons[0].message
