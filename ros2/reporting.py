"""An answer as messages: poses, markers for RViz, diagnostics."""

from __future__ import annotations

import math

import numpy as np

import linefix
from registration.layout import Floats

from . import messages as ros

OK, WARN, ERROR, STALE = range(4)  # as DiagnosticStatus counts
ARROW, LINES = 0, 5  # as Marker counts
ADD, DELETE = 0, 2
GREEN, AMBER = ros.ColorRGBA(0.1, 0.7, 0.2, 1.0), ros.ColorRGBA(0.9, 0.6, 0.0, 1.0)
GREY = ros.ColorRGBA(0.5, 0.5, 0.5, 0.6)
LINE_WIDTH = 0.04  # m
OF_INPUT = ("no_segments", "scan_exceeds_map", "unlikely_map_size")  # codes of warnings
PLANAR = np.array([0, 1, 5])  # x, y and the turn about z among ROS's six


def pose_of(pose: linefix.RigidTransform) -> ros.Pose:
    """Return a pose in the plane as one in space."""
    half = 0.5 * pose.theta
    return ros.Pose(ros.Point(pose.x, pose.y, 0.0), ros.Quaternion(0.0, 0.0, math.sin(half), math.cos(half)))


def stamped_pose(
    stamp: ros.Time, pose: linefix.RigidTransform, covariance: Floats, frame: str
) -> ros.PoseWithCovarianceStamped:
    """Return the robot's pose, map_from_base, with its covariance (3, 3) in the plane."""
    full = np.zeros((6, 6))
    full[np.ix_(PLANAR, PLANAR)] = covariance
    return ros.PoseWithCovarianceStamped(
        ros.Header(stamp, frame), ros.PoseWithCovariance(pose_of(pose), full.ravel().tolist())
    )


def at_least(covariance: Floats, sigma: float, sigma_theta: float) -> Floats:
    """Return a covariance whose standard deviations, in every direction of the plane, are at least so much.

    Parameters
    ----------
    covariance : (3, 3)
        Of x, y, theta.
    sigma, sigma_theta : float
        Metres, radians.
    """
    scale = np.array([1.0, 1.0, sigma / sigma_theta if sigma > 0.0 and sigma_theta > 0.0 else 1.0])
    scaled = covariance * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    floor: Floats = (vectors * np.maximum(values, sigma**2)) @ vectors.T / np.outer(scale, scale)
    return floor


def transform_of(stamp: ros.Time, frames: tuple[str, str], pose: linefix.RigidTransform) -> ros.TFMessage:
    """Return a transform for ``/tf``; `frames` are the parent and the child, `pose` is parent_from_child."""
    transform = ros.Transform(ros.Vector3(pose.x, pose.y, 0.0), pose_of(pose).orientation)
    return ros.TFMessage([ros.TransformStamped(ros.Header(stamp, frames[0]), frames[1], transform)])


def map_marker(walls: linefix.Segments, frame: str) -> ros.MarkerArray:
    """Return the walls of a map, to be shown once."""
    ends = walls.endpoints.reshape(-1, 2)
    points = [ros.Point(x, y, 0.0) for x, y in ends.tolist()]
    return ros.MarkerArray([_marker(frame, ros.Time(), "linefix/map", LINES, GREY, points=points)])


def answer_marker(answer: linefix.AssociationResult, stamp: ros.Time, frame: str) -> ros.MarkerArray:
    """Return the robot where it was found: green where that is usable, amber where not, gone where there is none."""
    color = GREEN if answer.usable else AMBER
    arrow = _marker(frame, stamp, "linefix/robot", ARROW, color)
    if answer.pose is None:
        arrow.action = DELETE
    else:
        arrow.pose, arrow.scale = pose_of(answer.pose), ros.Vector3(0.6, 0.12, 0.12)
    return ros.MarkerArray([arrow])


def _marker(
    frame: str, stamp: ros.Time, name: str, kind: int, color: ros.ColorRGBA, points: list[ros.Point] | None = None
) -> ros.Marker:
    thin, header = ros.Vector3(LINE_WIDTH, 0.0, 0.0), ros.Header(stamp, frame)
    return ros.Marker(header, name, type=kind, action=ADD, scale=thin, color=color, points=points or [])


def values_of(answer: linefix.AssociationResult, milliseconds: float) -> dict[str, str]:
    """Return the verdict of a scan as keys and values."""
    return {
        **({} if answer.map_id is None else {"map_id": answer.map_id}),
        "status": answer.status.value,
        "usable": str(answer.usable).lower(),
        "probability": "" if answer.probability is None else f"{answer.probability:.4f}",
        "message": answer.message,
        "reasons": ", ".join(reason.code for reason in answer.reasons),
        "warnings": ", ".join(warning.code for warning in answer.warnings),
        "milliseconds": f"{milliseconds:.1f}",
    }


def verdict_of(answer: linefix.AssociationResult) -> tuple[int, str]:
    """Return the level and the message of a scan's verdict; an input in another unit explains all reasons."""
    if answer.usable:
        return OK, "pose usable"
    causes = [one.message for one in answer.warnings if one.code in OF_INPUT]
    return WARN, [*causes, *(reason.message for reason in answer.reasons), answer.status.value][0]
