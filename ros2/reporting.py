"""An answer as messages: poses, markers for RViz, diagnostics."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

import linefix

from .locating import Located
from .messages import (
    ColorRGBA,
    DiagnosticStatus,
    Header,
    KeyValue,
    Marker,
    MarkerArray,
    Point,
    Pose,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    TFMessage,
    Time,
    Transform,
    TransformStamped,
    Vector3,
)

OK, WARN, ERROR, STALE = range(4)  # as DiagnosticStatus counts
ARROW, LINES = 0, 5  # as Marker counts
ADD, DELETE = 0, 2
GREEN, AMBER, GREY = ColorRGBA(0.1, 0.7, 0.2, 1.0), ColorRGBA(0.9, 0.6, 0.0, 1.0), ColorRGBA(0.5, 0.5, 0.5, 0.6)
LINE_WIDTH = 0.04  # m
Floats = NDArray[np.float64]

PLANAR = np.array([0, 1, 5])  # x, y and the turn about z among ROS's six


def pose_of(pose: linefix.RigidTransform) -> Pose:
    """Return a pose in the plane as one in space."""
    half = 0.5 * pose.theta
    return Pose(Point(pose.x, pose.y, 0.0), Quaternion(0.0, 0.0, math.sin(half), math.cos(half)))


def stamped_pose(
    stamp: Time, pose: linefix.RigidTransform, covariance: Floats, frame: str
) -> PoseWithCovarianceStamped:
    """Return the robot's pose, map_from_base, with its covariance (3, 3) in the plane."""
    full = np.zeros((6, 6))
    full[np.ix_(PLANAR, PLANAR)] = covariance
    return PoseWithCovarianceStamped(Header(stamp, frame), PoseWithCovariance(pose_of(pose), full.ravel().tolist()))


def at_least(covariance: Floats, sigma: float, sigma_theta: float) -> Floats:
    """Return a covariance whose standard deviations, in every direction of the plane, are at least so much.

    Parameters
    ----------
    covariance : (3, 3)
        Of x, y, theta.
    sigma, sigma_theta : float
        Metres, radians.
    """
    scale = np.array([1.0, 1.0, 1.0])
    scale[2] = sigma / sigma_theta if sigma > 0.0 and sigma_theta > 0.0 else 1.0
    widened = covariance * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(widened)
    floor: Floats = (vectors * np.maximum(values, sigma**2)) @ vectors.T / np.outer(scale, scale)
    return floor


def transform_of(stamp: Time, frames: tuple[str, str], pose: linefix.RigidTransform) -> TFMessage:
    """Return a transform for ``/tf``; `frames` are the parent and the child, `pose` is parent_from_child."""
    turn = pose_of(pose).orientation
    transform = Transform(Vector3(pose.x, pose.y, 0.0), turn)
    return TFMessage([TransformStamped(Header(stamp, frames[0]), frames[1], transform)])


def map_marker(walls: linefix.Segments, frame: str) -> MarkerArray:
    """Return the walls of a map, to be shown once."""
    ends = walls.endpoints.reshape(-1, 2)
    points = [Point(x, y, 0.0) for x, y in ends.tolist()]
    return MarkerArray([_marker(frame, Time(), "map", LINES, GREY, points=points)])


def answer_marker(located: Located, frame: str) -> MarkerArray:
    """Return the robot where it was found: green where that is usable, amber where not, gone where there is none."""
    color = GREEN if located.answer.usable else AMBER
    arrow = _marker(frame, located.stamp, "robot", ARROW, color)
    if located.pose is None:
        arrow.action = DELETE
    else:
        arrow.pose, arrow.scale = pose_of(located.pose), Vector3(0.6, 0.12, 0.12)
    return MarkerArray([arrow])


def _marker(
    frame: str, stamp: Time, name: str, kind: int, color: ColorRGBA, points: list[Point] | None = None
) -> Marker:
    return Marker(
        header=Header(stamp, frame), ns=f"linefix/{name}", type=kind, action=ADD, scale=Vector3(LINE_WIDTH, 0.0, 0.0),
        color=color, points=points or [],
    )  # fmt: skip


def values_of(located: Located, milliseconds: float) -> dict[str, str]:
    """Return the verdict of a scan as keys and values."""
    answer = located.answer
    return {
        **({} if answer.map_id is None else {"map": answer.map_id}),
        "status": answer.status.value,
        "usable": str(answer.usable).lower(),
        "probability": "" if answer.probability is None else f"{answer.probability:.4f}",
        "reasons": ", ".join(reason.code for reason in answer.reasons),
        "warnings": ", ".join(warning.code for warning in answer.warnings),
        "milliseconds": f"{milliseconds:.1f}",
    }


def verdict_of(located: Located) -> tuple[int, str]:
    """Return the level and the message of a scan's verdict."""
    answer = located.answer
    if answer.usable:
        return OK, "pose usable"
    return WARN, answer.reasons[0].message if answer.reasons else answer.status.value


def status_of(
    name: str, hardware_id: str, verdict: tuple[int, str], values: Mapping[str, str] | None = None
) -> DiagnosticStatus:
    """Return a status; `verdict` is its level and message."""
    pairs = [KeyValue(key, value) for key, value in (values or {}).items()]
    return DiagnosticStatus(verdict[0], name, verdict[1], hardware_id, pairs)
