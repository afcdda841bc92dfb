"""linefix replay: a log of another tool to poses with verdicts."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import linefix
from cli.logs import LOST, Tracker
from formats import LoggedScan
from registration import RigidTransform
from tests.association.scenes import known
from tests.map_quality.check.drawn import faces

from .drives import ODOM_FROM_MAP, write_log
from .running import Linefix

SCANS = 12


@pytest.fixture
def truth(tmp_path: Path) -> list[RigidTransform]:
    (tmp_path / "floor.json").write_text(json.dumps({"segments": faces().tolist()}))
    return write_log(tmp_path / "drive.log", SCANS)


def assert_right(found: list[dict[str, Any]], truth: list[RigidTransform]) -> None:
    for line, pose in zip(found, truth, strict=True):
        if line["usable"]:
            assert math.hypot(line["pose"]["x"] - pose.x, line["pose"]["y"] - pose.y) < 0.1
            assert abs(line["pose"]["theta"] - pose.theta) < 0.02


@pytest.mark.parametrize("mode", ["global", "track"])
def test_a_line_a_scan(linefix: Linefix, truth: list[RigidTransform], mode: str) -> None:
    ended = linefix.done("replay", "drive.log", "--map", "floor.json", "--mode", mode, "--json")
    found = ended.lines
    assert [line["stamp"] for line in found] == [100 + 0.5 * k for k in range(SCANS)]
    told = ["stamp", "status", "usable", "probability", "pose", "covariance", "reasons", "timing_ms", "child_frame_id"]
    assert list(found[0]) == [*told, "error"]
    usable = next(line for line in found if line["usable"])
    assert np.linalg.eigvalsh(np.array(usable["covariance"])).min() > 0.0
    assert sum(line["usable"] for line in found) >= SCANS // 2
    assert_right(found, truth)
    assert "ROBOTLASER1" in ended.err  # which of the topics was taken


def test_a_stored_map_its_poses_and_a_picture(linefix: Linefix, folder: Path, truth: list[RigidTransform]) -> None:
    linefix.done("map", "put", "floor", "floor.json")
    asked = ("replay", "drive.log", "--map", "floor", "--out", "poses.tum", "--picture", "poses.png")
    told = linefix.done(*asked)
    assert "ok, usable" in told.out
    assert "ROBOTLASER1" in told.out
    poses = [list(map(float, row.split())) for row in (folder / "poses.tum").read_text().splitlines()]
    assert len(poses) >= SCANS // 2
    by_stamp = {100 + 0.5 * k: pose for k, pose in enumerate(truth)}
    for stamp, x, y, *_ in poses:
        assert math.hypot(x - by_stamp[stamp].x, y - by_stamp[stamp].y) < 0.1
    with Image.open(folder / "poses.png") as picture:
        assert (0, 158, 115) in {colour for _, colour in picture.getcolors(1000) or []}


def answer(pose: RigidTransform, *, usable: bool = True, warning: str | None = None) -> dict[str, Any]:
    warnings = [] if warning is None else [{"code": warning}]
    return {"usable": usable, "pose": {"x": pose.x, "y": pose.y, "theta": pose.theta}, "warnings": warnings}


def test_poses_after_a_clock_was_set_back_are_in_a_file_of_their_own(
    linefix: Linefix, folder: Path, truth: list[RigidTransform]
) -> None:
    (folder / "twice.log").write_text(2 * (folder / "drive.log").read_text())
    ended = linefix.done("replay", "twice.log", "--map", "floor.json", "--every", "2", "--out", "poses.tum")
    for name in ("poses.tum", "poses-2.tum"):
        stamps = [float(row.split()[0]) for row in (folder / name).read_text().splitlines()]
        assert len(stamps) >= SCANS // 4
        assert stamps == sorted(set(stamps))
    assert "part 2 of the log, stamps 10" in ended.out


def scan_at(pose: RigidTransform | None, **odometry: Any) -> LoggedScan:
    return LoggedScan(0, "/scan", "laser", linefix.LaserScan(0.0, 0.1, [1.0]), pose=pose, **odometry)


def test_a_prior_follows_the_last_usable_pose_by_odometry() -> None:
    tracker, at = Tracker(), RigidTransform(2.0, 1.0, 0.5)
    before = scan_at(ODOM_FROM_MAP.compose(at))
    after = scan_at(ODOM_FROM_MAP.compose(RigidTransform(3.0, 1.2, 0.9)))
    assert tracker.prior(before) is None
    tracker.learn(answer(at, usable=False), before)
    assert tracker.prior(before) is None
    tracker.learn(answer(at), before)
    prior = known(tracker.prior(after))
    assert [round(value, 9) for value in (prior["x"], prior["y"], prior["theta"])] == [3.0, 1.2, 0.9]
    tracker.learn(answer(at, usable=False), after)
    again = known(tracker.prior(after))
    np.testing.assert_allclose(again["covariance"], prior["covariance"])
    tracker.learn(answer(at, warning="prior_contradicted"), after)
    assert tracker.prior(after) is None


def test_what_is_known_gets_less_with_the_way_and_ends() -> None:
    tracker, here = Tracker(), RigidTransform(0.0, 0.0, 0.0)
    tracker.prior(scan_at(here))
    tracker.learn(answer(here), scan_at(here))
    sigmas = []
    for k in range(1, 100):
        prior = tracker.prior(scan_at(RigidTransform(float(k % 2), 0.0, 0.0)))  # to and fro
        if prior is None:
            break
        sigmas.append(math.sqrt(prior["covariance"][0][0]))
    assert sigmas == sorted(sigmas)
    assert LOST - 0.2 < sigmas[-1] <= LOST


def test_what_odometry_does_not_know_widens_the_prior_and_another_part_ends_it() -> None:
    tracker, here = Tracker(), RigidTransform(0.0, 0.0, 0.0)
    tracker.prior(scan_at(here))
    tracker.learn(answer(here), scan_at(here))
    assert tracker.prior(scan_at(None)) is None
    sigmas = []
    for unknown_s in (0.0, 1.0, 3.0):
        prior = known(tracker.prior(scan_at(here, unknown_s=unknown_s)))
        sigmas.append(math.sqrt(prior["covariance"][0][0]))
    assert sigmas[1] > sigmas[0] + 0.9
    assert sigmas[2] > sigmas[1] + 1.8
    assert tracker.prior(scan_at(here, unknown_s=3.0, part=1)) is None
    assert tracker.prior(scan_at(here, unknown_s=3.0)) is None
