"""When a pose is published, and how the published transform follows."""

from __future__ import annotations

import math

import numpy as np
import pytest

from registration import RigidTransform
from ros2.agreement import Event, Observation
from ros2.deciding import InitialPose, MapToOdom
from ros2.reporting import at_least
from tests.association.scenes import known

SECOND = 1_000_000_000
TRUE = RigidTransform(3.0, -2.0, 0.7)  # map_from_odom


def decide(
    initial: InitialPose, event: Event, now: float, *, agrees: bool | None = None, lost: bool = False
) -> str | None:
    reason = initial.decide(new=event is Event.AGREED, localizer_agrees=agrees, lost=lost, now=now)
    if reason is not None:
        initial.published(subscribed=True, now=now)
    return reason


def test_it_is_published_once_at_the_start_and_on_request() -> None:
    initial = InitialPose()
    assert decide(initial, Event.AGREED, 1.0) == "agreed"
    assert [decide(initial, Event.CONFIRMED, 1.0 + k) for k in range(9)] == [None] * 9
    initial.want()
    assert decide(initial, Event.CONFIRMED, 21.0) == "agreed"


def test_a_localizer_with_another_pose_is_set_at_the_start() -> None:
    assert decide(InitialPose(), Event.AGREED, 0.0, agrees=False) == "agreed"


@pytest.mark.parametrize(("when", "expected"), [("start", None), ("lost", "lost"), ("always", "lost")])
def test_a_lost_localizer_is_set_where_that_is_wanted(when: str, expected: str | None) -> None:
    initial = InitialPose(when)  # type: ignore[arg-type]
    assert decide(initial, Event.AGREED, 0.0) == "agreed"
    assert decide(initial, Event.CONFIRMED, 20.0, agrees=False, lost=True) == expected
    assert decide(initial, Event.CONFIRMED, 20.1, agrees=False, lost=True) is None  # it needs time to take it


def test_always_is_limited_in_its_rate() -> None:
    initial = InitialPose("always")
    reasons = [decide(initial, Event.CONFIRMED, 0.1 * k) for k in range(11)]
    assert reasons.count(None) == 8


def confirmed(stamp: int, odometry: RigidTransform, off: float = 0.0) -> Observation:
    pose = TRUE.compose(odometry)
    return Observation(stamp, RigidTransform(pose.x + off, pose.y, pose.theta), np.eye(3) * 1e-6, True, odometry)


def test_the_transform_follows_in_small_steps() -> None:
    correction = MapToOdom()
    far = RigidTransform(50.0, 20.0, 1.0)  # of the origin of odometry
    assert correction.advance(0, far) is None
    correction.take(confirmed(0, far), new=True)
    assert correction.advance(SECOND, far) == correction.current
    correction.take(confirmed(SECOND, far, off=0.1), new=False)
    before = correction.advance(SECOND, far)
    half = correction.advance(SECOND + SECOND // 4, far)
    whole = correction.advance(3 * SECOND, far)
    assert before is not None
    assert half is not None
    assert whole is not None
    places = [one.compose(far).x for one in (before, half, whole)]
    assert np.subtract(places, places[0]) == pytest.approx([0.0, 0.05, 0.1], abs=1e-9)  # 0.2 m/s
    correction.take(confirmed(3 * SECOND, far, off=5.0), new=True)
    jumped = known(correction.advance(3 * SECOND, far))
    assert jumped.compose(far).x == pytest.approx(places[0] + 5.0)


def test_the_transform_never_follows_without_odometry() -> None:
    correction = MapToOdom()
    correction.take(Observation(0, TRUE, np.eye(3), True), new=True)
    assert correction.advance(0, TRUE) is None


def test_a_covariance_is_widened_in_every_direction() -> None:
    c, s = math.cos(0.6), math.sin(0.6)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    narrow = turn @ np.diag([1e-6, 0.04, 1e-8]) @ turn.T
    widened = turn.T @ at_least(narrow, 0.05, 0.03) @ turn
    assert np.sqrt(np.diag(widened)) == pytest.approx([0.05, 0.2, 0.03])
    assert at_least(narrow, 0.0, 0.0) == pytest.approx(narrow)
