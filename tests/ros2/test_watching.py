"""The pose of the localizer is compared with that of the scans."""

from __future__ import annotations

import math
from contextlib import nullcontext

import numpy as np
import pytest

from registration import RigidTransform
from ros2 import messages
from ros2.agreement import Observation
from ros2.deciding import Watch
from ros2.frames import FrameError, Frames
from ros2.odometry import OdometryHistory

from .robot import at_second, odometry_at, quaternion

SECOND = 1_000_000_000
MAP_FROM_ODOM = RigidTransform(2.0, 1.0, 0.5)
NAMES = "map", "odom"


def stamped(second: float) -> messages.Header:
    return messages.Header(at_second(second), "map")


def amcl(second: float, pose: RigidTransform, sigma: float = 0.1) -> messages.PoseWithCovarianceStamped:
    covariance = np.diag([sigma**2, sigma**2, 0.0, 0.0, 0.0, 0.05**2]).ravel().tolist()
    place = messages.Pose(messages.Point(pose.x, pose.y), quaternion(pose.theta))
    return messages.PoseWithCovarianceStamped(stamped(second), messages.PoseWithCovariance(place, covariance))


def history() -> OdometryHistory:
    odometry = OdometryHistory()
    for k in range(51):
        odometry.take(odometry_at(0.2 * k, RigidTransform(0.06 * k, 0.0, 0.0)))
    return odometry


def confirmed(second: int, off: float = 0.0) -> Observation:
    odometry = RigidTransform(0.3 * second, 0.0, 0.0)
    pose = MAP_FROM_ODOM.compose(odometry)
    return Observation(
        second * SECOND, RigidTransform(pose.x + off, pose.y, pose.theta), np.eye(3) * 1e-4, True, odometry
    )


def published(second: float, pose: RigidTransform = MAP_FROM_ODOM) -> messages.TFMessage:
    transform = messages.Transform(messages.Vector3(pose.x, pose.y, 0.0), quaternion(pose.theta))
    return messages.TFMessage([messages.TransformStamped(stamped(second), "odom", transform)])


def test_nothing_is_known_without_a_localizer() -> None:
    watch = Watch(Frames(), history())
    assert watch.compare(confirmed(3), *NAMES) is None
    assert not watch.lost


@pytest.mark.parametrize("off", [0.0, 0.2, -0.2])
def test_amcl_agrees_as_odometry_carries_it(off: float) -> None:
    watch = Watch(Frames(), history())
    pose = MAP_FROM_ODOM.compose(RigidTransform(0.6, 0.0, 0.0))
    watch.take(amcl(2.0, pose))
    assert watch.compare(confirmed(7, off), *NAMES) is True


def test_the_transform_of_the_map_counts_where_it_is_published() -> None:
    frames = Frames()
    watch = Watch(frames, history())
    watch.take(amcl(2.0, RigidTransform(9.0, 9.0, 0.0)))
    assert frames.take(published(6.9), static=False) == []
    assert frames.take(published(7.1), static=False) == []
    assert watch.compare(confirmed(7), *NAMES) is True
    assert watch.compare(confirmed(10), *NAMES) is False  # by amcl_pose: the transform is too old


def test_a_transform_of_this_node_is_not_that_of_a_localizer() -> None:
    frames = Frames()
    watch = Watch(frames, history(), transforms=False)
    assert frames.take(published(7.0), static=False) == []
    assert watch.compare(confirmed(7, off=2.0), *NAMES) is None
    watch.take(amcl(7.0, MAP_FROM_ODOM.compose(RigidTransform(2.1, 0.0, 0.0))))
    assert watch.compare(confirmed(7), *NAMES) is True


def test_a_localizer_is_lost_after_some_scans_and_found_again() -> None:
    frames = Frames()
    watch = Watch(frames, history())
    frames.take(published(7.0), static=False)
    for k in range(3):
        assert not watch.lost, k
        assert watch.compare(confirmed(7, off=2.0), *NAMES) is False
    assert watch.lost
    assert watch.compare(confirmed(7), *NAMES) is True
    assert not watch.lost


def test_a_wide_localizer_is_not_lost() -> None:
    watch = Watch(Frames(), history())
    watch.take(amcl(7.0, MAP_FROM_ODOM.compose(RigidTransform(2.1, 0.0, 0.0)), sigma=1.0))
    assert watch.compare(confirmed(7, off=2.0), *NAMES) is True


@pytest.mark.parametrize("entry", [math.nan, math.inf, -1.0, 1e300])
def test_a_covariance_that_is_none_ends_nothing(entry: float) -> None:
    """The pose counts, and what is wrong is reported."""
    watch = Watch(Frames(), history())
    message = amcl(7.0, MAP_FROM_ODOM)
    message.pose.covariance[0] = entry
    message.pose.covariance[1] = entry
    with nullcontext() if entry == -1.0 else pytest.raises(FrameError, match="found a covariance with"):
        watch.take(message)
    assert watch.compare(confirmed(7), *NAMES) in (True, False)


def test_a_pose_that_is_none_is_refused() -> None:
    with pytest.raises(FrameError, match="expected a position"):
        Watch(Frames(), history()).take(amcl(7.0, RigidTransform(1e300, 0.0, 0.0)))
