"""Poses out."""

from __future__ import annotations

import math
from pathlib import Path

from formats import StampedPose, write_tum
from registration import RigidTransform


def test_tum_has_a_line_a_pose_with_the_time_to_the_nanosecond(tmp_path: Path) -> None:
    poses = [StampedPose(1_700_000_000_000_000_005, RigidTransform(1.5, -2.25, math.pi / 2))]
    assert write_tum(poses, tmp_path / "a.tum") == 1
    half = f"{math.sqrt(0.5):.12f}"
    text = (tmp_path / "a.tum").read_text()
    assert text == f"1700000000.000000005 1.500000000 -2.250000000 0 0 0 {half} {half}\n"
