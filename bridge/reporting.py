"""An answer as messages: poses, markers for RViz, diagnostics."""

from __future__ import annotations

import math

import numpy as np

import linefix

from .locating import Located
from .messages import (
    ColorRGBA,
    DiagnosticArray,
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
    Time,
    Vector3,
)

OK, WARN, ERROR, STALE = range(4)  # as DiagnosticStatus counts
ARROW, LINES = 0, 5  # as Marker counts
ADD, DELETE = 0, 2
GREEN, AMBER, GREY = ColorRGBA(0.1, 0.7, 0.2, 1.0), ColorRGBA(0.9, 0.6, 0.0, 1.0), ColorRGBA(0.5, 0.5, 0.5, 0.6)
LINE_WIDTH = 0.04  # m
PLANAR = np.array([0, 1, 5])  # x, y and the turn about z among ROS's six


def pose_of(pose: linefix.RigidTransform) -> Pose:
    """Return a pose in the plane as one in space."""
    half = 0.5 * pose.theta
    return Pose(Point(pose.x, pose.y, 0.0), Quaternion(0.0, 0.0, math.sin(half), math.cos(half)))


def stamped_pose(located: Located, frame: str) -> PoseWithCovarianceStamped | None:
    """Return the robot's pose with its covariance; None where there is none, or it is not known in each direction."""
    if located.pose is None or located.covariance is None:
        return None
    full = np.zeros((6, 6))
    full[np.ix_(PLANAR, PLANAR)] = located.covariance
    pose = PoseWithCovariance(pose_of(located.pose), full.ravel().tolist())
    return PoseWithCovarianceStamped(Header(located.stamp, frame), pose)


def map_marker(index: linefix.MapIndex, frame: str) -> MarkerArray:
    """Return the walls of a map, to be shown once."""
    ends = index.segments.endpoints[: index.directed].reshape(-1, 2)
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


def diagnosis(located: Located, milliseconds: float) -> DiagnosticArray:
    """Return how the last scan was answered."""
    answer = located.answer
    told = {
        "status": answer.status.value,
        "usable": str(answer.usable).lower(),
        "probability": f"{answer.probability:.4f}",
        "reasons": ", ".join(reason.code for reason in answer.reasons),
        "warnings": ", ".join(warning.code for warning in answer.warnings),
        "milliseconds": f"{milliseconds:.1f}",
    }
    message = "pose usable" if answer.usable else (answer.reasons[0].message if answer.reasons else told["status"])
    return _diagnostics(located.stamp, OK if answer.usable else WARN, message, told)


def complaint(stamp: Time, message: str) -> DiagnosticArray:
    """Return why no scan can be answered."""
    return _diagnostics(stamp, ERROR, message, {})


def _diagnostics(stamp: Time, level: int, message: str, values: dict[str, str]) -> DiagnosticArray:
    pairs = [KeyValue(key, value) for key, value in values.items()]
    return DiagnosticArray(Header(stamp, ""), [DiagnosticStatus(level, "linefix: localization", message, "", pairs)])
