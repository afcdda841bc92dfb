"""linefix replay: whose poses are informed, and logs of which some cannot be taken."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cli.errors import RefusedError
from cli.logs import Frames, odometry_of
from formats import LoggedScan
from registration import RigidTransform
from tests.association.scenes import known
from tests.map_quality.check.drawn import faces
from tests.running import RunningService
from vectorization import LaserScan

from .drives import write_log
from .running import Ended, Linefix

SCANS = 4
MOUNT = RigidTransform(0.4, -0.2, 1.2)
ASKED = ("replay", "drive.log", "--map", "floor.json", "--mode", "global")


@pytest.fixture(autouse=True)
def truth(folder: Path) -> list[RigidTransform]:
    (folder / "floor.json").write_text(json.dumps({"segments": faces().tolist()}))
    return write_log(folder / "drive.log", SCANS, mount=MOUNT)


def lines(ended: Ended, code: int = 0) -> list[dict[str, Any]]:
    assert ended.code == code, ended.err
    return ended.lines


def assert_at(found: dict[str, Any], expected: RigidTransform) -> None:
    pose = found["pose"]
    assert math.hypot(pose["x"] - expected.x, pose["y"] - expected.y) < 0.1
    assert abs(math.remainder(pose["theta"] - expected.theta, math.tau)) < 0.02


def test_poses_are_those_of_the_robot_where_the_log_has_its_mount(
    linefix: Linefix, folder: Path, truth: list[RigidTransform]
) -> None:
    ended = linefix(*ASKED, "--out", "poses.tum", "--json")
    found = lines(ended)
    assert {line["child_frame_id"] for line in found} == {"robot"}
    usable = [(line, pose) for line, pose in zip(found, truth, strict=True) if line["usable"]]
    assert len(usable) >= SCANS // 2
    for line, pose in usable:
        assert_at(line, pose.compose(MOUNT.inverse()))
    first = [float(number) for number in (folder / "poses.tum").read_text().split()[:3]]
    assert first[1:] == pytest.approx([usable[0][0]["pose"]["x"], usable[0][0]["pose"]["y"]])
    assert "of the robot (frame robot), with ROBOTLASER1 mounted at (0.400, -0.200) m, 68.8 degrees, from the log" in (
        ended.err
    )


def test_a_mount_that_is_given_goes_first(linefix: Linefix, truth: list[RigidTransform]) -> None:
    ended = linefix(*ASKED, "--mount", "-1.0", "0.5", "0.3", "--json")
    (line, pose), *_ = ((line, pose) for line, pose in zip(lines(ended), truth, strict=True) if line["usable"])
    assert_at(line, pose.compose(RigidTransform(-1.0, 0.5, 0.3).inverse()))
    assert line["child_frame_id"] == "base_link"
    assert "from --mount" in ended.err


def test_without_a_mount_they_are_those_of_the_laser(
    linefix: Linefix, folder: Path, truth: list[RigidTransform]
) -> None:
    # RAWLASER1 says as much of the scan, and nothing of where anything was.
    told = [row.split() for row in (folder / "drive.log").read_text().splitlines()[1:]]
    rows = [" ".join(["RAWLASER1", *words[1:-13], words[-1], *words[-2:]]) for words in told]
    (folder / "drive.log").write_text("\n".join(rows) + "\n")
    ended = linefix(*ASKED, "--json")
    (line, pose), *_ = ((line, pose) for line, pose in zip(lines(ended), truth, strict=True) if line["usable"])
    assert_at(line, pose)
    assert line["child_frame_id"] == "RAWLASER1"
    assert "set --mount X Y THETA for those of the robot" in ended.err


def test_a_scan_that_a_server_refuses_is_a_row_and_the_replay_goes_on(
    linefix: Linefix, folder: Path, start_service: Callable[..., RunningService]
) -> None:
    rows = (folder / "drive.log").read_text().splitlines()
    words = rows[2].split()
    beams = int(words[8])
    words[3:5] = str(0.01 * (beams + 8)), "0.01"
    rows[2] = " ".join([*words[:8], str(beams + 9), *["1.0"] * 9, *words[9:]])
    (folder / "drive.log").write_text("\n".join(rows) + "\n")
    asked = (*ASKED, "--server", start_service(max_beams=beams).url)
    found = lines(linefix(*asked, "--json"))
    assert [line["error"] is None for line in found] == [True, False, True, True]
    assert (found[1]["status"], found[1]["usable"], found[1]["pose"]) == (None, False, None)
    assert "ranges" in found[1]["error"]
    told = linefix.done(*asked)
    assert "refused" in told.out
    assert "25.0 %" in told.out


def test_where_a_server_refuses_every_scan_so_is_the_log(
    linefix: Linefix, folder: Path, start_service: Callable[..., RunningService]
) -> None:
    asked = (*ASKED, "--server", start_service(max_beams=100).url, "--json")
    ended = linefix(*asked)
    assert [line["usable"] for line in lines(ended, 3)] == [False] * SCANS
    assert "at most 100 ranges" in ended.err


def test_what_comes_before_the_place_where_a_log_is_broken_counts(linefix: Linefix, folder: Path) -> None:
    with (folder / "drive.log").open("a") as log:
        log.write("FLASER " + "1" * 3_000_000)
    ended = linefix(*ASKED, "--out", "poses.tum")
    assert ended.code == 3
    assert "ok, usable" in ended.out
    assert (folder / "poses.tum").read_text()
    assert "linefix: drive.log: line 6: expected at most" in ended.err


def scan(mount: RigidTransform | None, pose: RigidTransform | None = None) -> LoggedScan:
    laser = LaserScan(0.0, 0.1, [1.0, 1.0])
    return LoggedScan(0, "/scan", "laser", laser, pose=pose, mount=mount, base_frame="base_link" if mount else "")


def test_one_scan_without_a_mount_among_others_is_not_taken() -> None:
    frames = Frames(None)
    assert frames.taken(scan(MOUNT)).mount == MOUNT
    with pytest.raises(RefusedError, match="has no mount of laser at this time"):
        frames.taken(scan(None))
    of_laser = Frames(None)
    assert of_laser.taken(scan(None)).mount is None
    assert of_laser.taken(scan(MOUNT)).mount is None
    given = Frames(RigidTransform(1.0, 2.0, 3.0))
    assert given.taken(scan(MOUNT)).mount == given.given
    assert given.taken(scan(None)).mount == given.given


def test_odometry_is_of_the_frame_whose_poses_are_located() -> None:
    robot = RigidTransform(3.0, -1.0, 0.4)
    found = known(odometry_of(scan(MOUNT, robot.compose(MOUNT))))
    assert (found.x, found.y, found.theta) == pytest.approx((robot.x, robot.y, robot.theta))
    assert odometry_of(scan(None, robot)) == robot
    assert odometry_of(scan(MOUNT)) is None
