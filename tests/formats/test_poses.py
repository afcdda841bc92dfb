"""Poses out."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from formats import StampedPose, pose_message, write_tum
from registration import RigidTransform


def test_tum_has_a_line_a_pose_with_the_time_to_the_nanosecond(tmp_path: Path) -> None:
    poses = [StampedPose(1_700_000_000_000_000_005, RigidTransform(1.5, -2.25, math.pi / 2))]
    assert write_tum(poses, tmp_path / "a.tum") == 1
    half = f"{math.sqrt(0.5):.12f}"
    text = (tmp_path / "a.tum").read_text()
    assert text == f"1700000000.000000005 1.500000000 -2.250000000 0 0 0 {half} {half}\n"


def test_a_message_has_a_quaternion_and_36_numbers() -> None:
    covariance = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 5.0], [3.0, 5.0, 6.0]])
    message = pose_message(StampedPose(2_500_000_000, RigidTransform(1.0, 2.0, math.pi), covariance), "hall")
    assert message["header"] == {"stamp": {"sec": 2, "nanosec": 500_000_000}, "frame_id": "hall"}
    pose = message["pose"]["pose"]
    assert pose["position"] == {"x": 1.0, "y": 2.0, "z": 0.0}
    np.testing.assert_allclose([pose["orientation"][k] for k in "xyzw"], [0, 0, 1, 0], atol=1e-15)
    full = message["pose"]["covariance"]
    at = {0: 1.0, 1: 2.0, 5: 3.0, 6: 2.0, 7: 4.0, 11: 5.0, 30: 3.0, 31: 5.0, 35: 6.0}
    assert full == [at.get(k, 0.0) for k in range(36)]
    assert pose_message(StampedPose(0, RigidTransform(0, 0, 0)))["pose"]["covariance"] == [0.0] * 36
