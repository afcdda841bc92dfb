"""Poses out: TUM for evo, and ROS's PoseWithCovarianceStamped."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform

NS = 1_000_000_000


@dataclass(frozen=True, slots=True, eq=False)
class StampedPose:
    """A pose of the robot with its time.

    Attributes
    ----------
    stamp_ns : int
        Nanoseconds.
    pose : RigidTransform
        map_from_scan.
    covariance : (3, 3) or None
        Of additive (x, y, theta) in the map frame; m^2, m rad, rad^2; None: not known.
    """

    stamp_ns: int
    pose: RigidTransform
    covariance: NDArray[np.float64] | None = None


def write_tum(poses: Iterable[StampedPose], path: str | os.PathLike[str]) -> int:
    """Write poses as TUM has them: ``seconds x y z qx qy qz qw`` a line; return how many.

    Parameters
    ----------
    poses : iterable of StampedPose
    path : str or path
    """
    count = 0
    with Path(path).open("w", encoding="ascii", newline="\n") as file:
        for one in poses:
            seconds, rest = divmod(one.stamp_ns, NS)
            z, w = math.sin(0.5 * one.pose.theta), math.cos(0.5 * one.pose.theta)
            file.write(f"{seconds}.{rest:09d} {one.pose.x:.9f} {one.pose.y:.9f} 0 0 0 {z:.12f} {w:.12f}\n")
            count += 1
    return count


def pose_message(one: StampedPose, frame_id: str = "map") -> dict[str, Any]:
    """Return a pose as the fields of ``geometry_msgs/PoseWithCovarianceStamped``.

    Parameters
    ----------
    one : StampedPose
    frame_id : str
        The map's.

    Returns
    -------
    dict
        Names as in ROS; the covariance in 36 numbers, row by row over x, y, z and the rotations about them. Entries
        outside of the plane are 0. All entries are 0 if the covariance is unknown, as in ROS.
    """
    sec, nanosec = divmod(one.stamp_ns, NS)
    full = np.zeros((6, 6))
    if one.covariance is not None:
        planar = np.array([0, 1, 5])
        full[np.ix_(planar, planar)] = one.covariance
    half = 0.5 * one.pose.theta
    return {
        "header": {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": frame_id},
        "pose": {
            "pose": {
                "position": {"x": one.pose.x, "y": one.pose.y, "z": 0.0},
                "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)},
            },
            "covariance": full.ravel().tolist(),
        },
    }
