"""When an answer is one of many along a direction, and which of them is given."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from association import HardPrior, MapIndex, SoftPrior
from association.explain import explain
from association.families import free_direction, is_degenerate, place_on_family
from registration import RegistrationResult, RigidTransform
from registration.layout import Floats

from .answers import answer_with, deviating, ranked, registered_corridor, registered_room, room
from .scenes import INSIDE, context_of, index_of, pose, scan_of


@pytest.mark.parametrize(
    ("registered", "degenerate"),
    [
        (deviating(0.49, 0.1), False),
        (deviating(0.51, 0.1), True),
        (deviating(0.1, 0.49), False),
        (deviating(0.1, 0.51), True),
        (deviating(0.5, 0.5), False),
        (deviating(0.45, 0.45), False),
        (deviating(0.45, 0.45, 0.9), True),
        (deviating(0.45, 0.45, -0.9), True),
        (deviating(0.49, 0.3, 0.5), True),
    ],
)
def test_a_position_is_fixed_to_half_a_metre(registered: RegistrationResult, degenerate: bool) -> None:
    """Along its weakest direction, whichever that is."""
    assert is_degenerate(registered) is degenerate


def test_what_registration_calls_degenerate_is() -> None:
    """Without a covariance its word is all there is."""
    assert is_degenerate(registered_corridor())
    assert not is_degenerate(registered_room())
    assert is_degenerate(replace(registered_room(), degenerate=True))
    assert not is_degenerate(replace(registered_room(), covariance=None))
    assert is_degenerate(replace(registered_room(), covariance=None, degenerate=True))


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.5, math.pi / 2, 2.0, 3.1])
def test_the_direction_that_is_not_fixed(angle: float) -> None:
    """That of the greatest deviation; of the two opposite ones that to the right, or straight up."""
    d, n = np.array([math.cos(angle), math.sin(angle)]), np.array([-math.sin(angle), math.cos(angle)])
    covariance = np.diag([0.0, 0.0, 1.0])
    covariance[:2, :2] = 0.36 * np.outer(d, d) + 0.01 * np.outer(n, n)
    free = free_direction(replace(registered_room(), covariance=covariance))
    expected = d if d[0] > 1e-9 or (abs(d[0]) < 1e-9 and d[1] > 0.0) else -d
    assert free == pytest.approx(expected.tolist(), abs=1e-9)


def test_straight_up_is_up() -> None:
    upright = replace(registered_room(), covariance=np.diag([0.01, 0.36, 1e-4]))
    assert free_direction(upright) == (0.0, 1.0)
    assert free_direction(replace(upright, covariance=np.diag([0.36, 0.01, 1e-4]))) == (1.0, 0.0)


def test_what_registration_leaves_free_is_free() -> None:
    assert free_direction(registered_corridor()) == pytest.approx((1.0, 0.0))
    assert free_direction(replace(registered_room(), unobservable=(0.6, 0.8))) == (0.6, 0.8)
    assert free_direction(replace(registered_room(), covariance=None)) is None


def placed(index: MapIndex, endpoints: Floats, prior: SoftPrior | HardPrior | None = None) -> RigidTransform:
    """Search, and return the member of the family that is answered."""
    context = context_of(index, scan_of(endpoints), prior)
    answer = explain(context).answer
    assert answer is not None
    assert answer.registered.degenerate
    found = place_on_family(context, answer)
    assert found is not None
    return found


# Three walls, the second one 10 m farther on than the first; seen 0.8 m beside the first as 2 or 3 m of each.
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
    free = replace(registered_room(), unobservable=(0.6, 0.8), covariance=None, degenerate=True)
    best = ranked(at=pose(1.0, -0.5, 0.7))  # of the index frame
    found = place_on_family(context, answer_with(best, free))
    assert found is not None
    x, y = context.index.origin
    away = 0.6 * (1.0 + x - INSIDE.x) + 0.8 * (-0.5 + y - INSIDE.y)
    assert (found.x, found.y) == pytest.approx((INSIDE.x + 0.6 * away, INSIDE.y + 0.8 * away))
    assert found.theta == pytest.approx(INSIDE.theta)
    known = SoftPrior(pose(4.0, 2.5, 0.0), np.eye(3))
    found = place_on_family(room(with_beams=True, prior=known), answer_with(best, free))
    assert found is not None
    assert (found.x, found.y) == pytest.approx((INSIDE.x + 0.6 * 0.6, INSIDE.y + 0.6 * 0.8)), "a prior goes before"


def test_a_pose_that_is_fixed_stays() -> None:
    for registered in (registered_room(), deviating(0.6, 0.1), replace(registered_room(), pose=None)):
        assert place_on_family(room(), answer_with(ranked(), registered)) == registered.pose
