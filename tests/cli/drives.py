"""A drive along a corridor, recorded as CARMEN does."""

from __future__ import annotations

import math
from pathlib import Path

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


def write_log(path: Path, count: int, *, drift: float = 1.02, mount: RigidTransform = CENTRE) -> list[RigidTransform]:
    """Write a log of the drive, odometry too long by a factor; return where the scans were taken."""
    rng, walls = np.random.default_rng(5), Segments.from_array(faces())
    poses, lines = drive(count), ["# a log"]
    for k, pose in enumerate(poses):
        ranges = scan(walls, pose, SCANNER, rng).ranges
        told = " ".join(f"{min(r, SCANNER.range_max):.4f}" if math.isfinite(r) else "99" for r in ranges)
        begun = poses[0]
        driven = RigidTransform(begun.x + drift * (pose.x - begun.x), pose.y, pose.theta)
        odom = ODOM_FROM_MAP.compose(driven)
        laser, robot = (f"{at.x:.6f} {at.y:.6f} {at.theta:.6f}" for at in (odom, odom.compose(mount.inverse())))
        head = f"ROBOTLASER1 0 {SCANNER.angle_min:.6f} {math.tau:.6f} {SCANNER.angle_increment:.9f}"
        head += f" {SCANNER.range_max} 0.01 0 {BEAMS}"
        lines.append(f"{head} {told} 0 {laser} {robot} 0 0 0 0 0 {100 + 0.5 * k} host {100 + 0.5 * k}")
    path.write_text("\n".join(lines) + "\n")
    return poses
