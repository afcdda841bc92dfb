"""linefix replay and map check: bags without odometry, and of a robot that moves during scans."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from registration import RigidTransform, Segments
from tests.formats.bags import SECOND, Laser, Robots
from tests.linefix.moving import moving_ranges
from tests.running import RunningService
from vectorization import Motion

from .running import Linefix

BEAMS = 400
STEP = math.tau / BEAMS
ROOM: list[list[float]] = [[0, 0, 7, 0], [7, 0, 7, 3], [7, 3, 4, 3], [4, 3, 4, 6], [4, 6, 0, 6], [0, 6, 0, 0]]
MOUNT = RigidTransform(0.3, 0.1, 0.5)
TWIST = (0.3, 0.0, 1.0)
SECONDS = 0.1  # of a scan
COUNT = 4


def swept(walls: list[list[float]], robot: RigidTransform, mount: RigidTransform, *, moving: bool, seed: int) -> Any:
    """Return the ranges of a scanner on a robot that moves at `TWIST`, or stands."""
    motion = Motion(SECONDS / BEAMS, *(TWIST if moving else (0.0, 0.0, 0.0)))
    map_walls, rng = Segments.from_array(np.array(walls, dtype=float)), np.random.default_rng(seed)
    return moving_ranges(map_walls, robot, mount, STEP * np.arange(BEAMS) - math.pi, motion, rng).astype(np.float32)


def put_scan(bag: Robots, ns: int, ranges: Any, frame: str = "laser", *, moving: bool = False) -> None:
    beat, last = SECONDS / BEAMS if moving else 0.0, -math.pi + STEP * (BEAMS - 1)
    bag.scan(ns, frame=frame, laser=Laser(ranges, -math.pi, last, STEP, 0.05, 30.0, beat, SECONDS))


def robots() -> list[RigidTransform]:
    return [RigidTransform(1.5 + 0.4 * k, 1.5, 0.5 * k) for k in range(COUNT)]


def quaternion(pose: RigidTransform) -> tuple[float, float, float, float]:
    return (0.0, 0.0, math.sin(0.5 * pose.theta), math.cos(0.5 * pose.theta))


def write_drive(folder: Path, *, odometry: bool, moving: bool = True) -> None:
    """Write a bag of a robot that turns while it scans; the folder is ``robot_mcap``."""
    (folder / "room.json").write_text(json.dumps({"segments": ROOM}))
    bag = Robots("mcap", folder)
    bag.transform("/tf_static", 0, "base_link", "laser", (MOUNT.x, MOUNT.y, 0.2), quaternion(MOUNT))
    for k, robot in enumerate(robots()):
        begun = (k + 1) * SECOND
        for j in range(-2, 5) if odometry else ():
            seconds = j * 0.05
            x, y, theta = Motion(seconds, *TWIST).places(2)[1]
            at = robot.compose(RigidTransform(x, y, theta))
            bag.transform("/tf", begun + round(seconds * SECOND), "odom", "base_link", (at.x, at.y, 0), quaternion(at))
        put_scan(bag, begun, swept(ROOM, robot, MOUNT, moving=moving, seed=k), moving=moving)
    bag.done()


def errors(found: list[dict[str, Any]]) -> list[tuple[float, float]]:
    """Return by how much each usable pose is wrong, metres and radians."""
    return [
        (
            math.hypot(line["pose"]["x"] - truth.x, line["pose"]["y"] - truth.y),
            abs(math.remainder(line["pose"]["theta"] - truth.theta, math.tau)),
        )
        for line, truth in zip(found, robots(), strict=True)
        if line["usable"]
    ]


ASKED = ("replay", "robot_mcap", "--map", "room.json", "--json")


@pytest.mark.parametrize("mode", ["global", "track"])
def test_a_robot_that_turns_while_it_scans_is_where_odometry_takes_each_beam(
    linefix: Linefix, folder: Path, mode: str
) -> None:
    write_drive(folder, odometry=True)
    ended = linefix.done(*ASKED, "--mode", mode)
    found = errors(ended.lines)
    assert len(found) == COUNT
    assert max(metres for metres, _ in found) < 0.03
    assert max(radians for _, radians in found) < 0.01
    assert "is not known" not in ended.err


def test_without_odometry_its_covariance_says_how_far_it_may_be_off(linefix: Linefix, folder: Path) -> None:
    write_drive(folder, odometry=False)
    ended = linefix.done(*ASKED, "--out", "poses.tum")
    found = errors(ended.lines)
    assert found
    assert max(radians for _, radians in found) < 0.1  # two standard deviations of 1 rad/s over 0.05 s
    assert "no odometry was found" in ended.err
    assert "scans with a time_increment, but without the motion of the sensor" in ended.err


@pytest.mark.parametrize("odometry", [True, False])
def test_a_server_answers_the_same(linefix: Linefix, folder: Path, service: RunningService, odometry: bool) -> None:
    write_drive(folder, odometry=odometry)
    here, there = linefix.done(*ASKED).lines, linefix.done(*ASKED, "--server", service.url).lines
    for one in (*here, *there):
        one.pop("timing_ms")
    assert here == there


def test_a_check_takes_the_motion_of_the_scans(linefix: Linefix, folder: Path) -> None:
    write_drive(folder, odometry=True)
    samples = linefix.done("map", "check", "room.json", "--log", "robot_mcap", "--json").answer["samples"]["scans"]
    for one, robot in zip(samples, robots(), strict=True):
        sensor = robot.compose(MOUNT)
        assert one["usable"]
        assert math.remainder(one["pose"]["theta"] - sensor.theta, math.tau) == pytest.approx(0.0, abs=0.01)


def test_a_scanner_that_is_mounted_upside_down_is_named(linefix: Linefix, folder: Path) -> None:
    (folder / "room.json").write_text(json.dumps({"segments": ROOM}))
    bag = Robots("mcap", folder)
    bag.transform("/tf_static", 0, "base_link", "laser", (MOUNT.x, MOUNT.y, 0.2), (1.0, 0.0, 0.0, 0.0))
    for k, robot in enumerate(robots()):
        seen = swept(ROOM, robot, RigidTransform(MOUNT.x, MOUNT.y, 0.0), moving=False, seed=k)
        put_scan(bag, (k + 1) * SECOND, seen[::-1].copy())
    bag.done()
    ended = linefix.done(*ASKED)
    assert sum(line["usable"] for line in ended.lines) >= COUNT - 1
    assert "laser mounted upside down at (0.300, 0.100) m" in ended.err
