"""A drive along a corridor, recorded as CARMEN does."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from registration import RigidTransform, Segments
from simulation import Scanner, scan
from tests.map_quality.check.drawn import faces

BEAMS = 360
SCANNER = Scanner(beams=BEAMS, angle_increment=math.tau / BEAMS)
CENTRE = RigidTransform(0.0, 0.0, 0.0)
ODOM_FROM_MAP = RigidTransform(-5.0, 3.0, 0.7)  # where odometry has begun


def drive(count: int) -> list[RigidTransform]:
    """Return map_from_laser for each scan."""
    return [RigidTransform(x, 0.9 + 0.1 * math.sin(x), 0.1 * math.cos(x)) for x in np.linspace(3.0, 19.0, count)]


def carmen(seconds: float, ranges: Any, scanner: Scanner, laser: str, robot: str) -> str:
    """Return a scan as CARMEN logs it; `laser` and `robot` are where odometry has them."""
    told = " ".join(f"{min(r, scanner.range_max):.4f}" if math.isfinite(r) else "99" for r in ranges)
    head = (
        f"ROBOTLASER1 0 {scanner.angle_min:.6f} {math.tau:.6f} {scanner.angle_increment:.9f} {scanner.range_max} 0.01 0"
    )
    return f"{head} {len(ranges)} {told} 0 {laser} {robot} 0 0 0 0 0 {seconds} host {seconds}\n"


def numbers(at: RigidTransform) -> str:
    return f"{at.x:.6f} {at.y:.6f} {at.theta:.6f}"


def write_log(path: Path, count: int, *, drift: float = 1.02, mount: RigidTransform = CENTRE) -> list[RigidTransform]:
    """Write a log of the drive, odometry too long by a factor; return where the scans were taken."""
    rng, walls = np.random.default_rng(5), Segments.from_array(faces())
    poses, lines = drive(count), ["# a log\n"]
    for k, pose in enumerate(poses):
        ranges = scan(walls, pose, SCANNER, rng).ranges
        driven = RigidTransform(poses[0].x + drift * (pose.x - poses[0].x), pose.y, pose.theta)
        odom = ODOM_FROM_MAP.compose(driven)
        lines.append(carmen(100 + 0.5 * k, ranges, SCANNER, numbers(odom), numbers(odom.compose(mount.inverse()))))
    path.write_text("".join(lines))
    return poses
