"""An answer in words, next to the truth."""

from __future__ import annotations

import math
from typing import Any

from association import AS_WELL
from registration import RigidTransform, wrap_angle

Answer = dict[str, Any]
NEAR = 0.1  # m from the truth, within which a pose is the right one


def equals(answer: Answer) -> list[dict[str, Any]]:
    """Return the alternatives that explain the scan about as well as the first pose."""
    least = answer["diagnostics"]["score"] - AS_WELL
    return [other for other in answer["alternatives"] if other["score"] >= least]


def verdict_in_words(answer: Answer) -> str:
    """Say what the answer means for a robot, in the service's own words."""
    message: str = answer["message"]
    return message


def pose_in_words(pose: dict[str, float] | RigidTransform | None) -> str:
    """Write a pose with its units."""
    if pose is None:
        return "none"
    if isinstance(pose, RigidTransform):
        pose = {"x": pose.x, "y": pose.y, "theta": pose.theta}
    x, y, theta = pose["x"], pose["y"], pose["theta"]
    return f"x {x:7.3f} m, y {y:7.3f} m, heading {math.degrees(theta):7.2f} deg"


def distance(pose: dict[str, float], truth: RigidTransform) -> tuple[float, float]:
    """Return how far a pose is from the truth: metres, and radians from 0 to pi."""
    turned = abs(wrap_angle(pose["theta"] - truth.theta))
    return math.hypot(pose["x"] - truth.x, pose["y"] - truth.y), turned


def comparison_in_words(answer: Answer, truth: RigidTransform | None) -> str:
    """Say how far the answer is from the truth."""
    pose = answer["pose"]
    if truth is None:
        return "elsewhere, so this is right" if pose is None else "elsewhere, so this is wrong"
    if pose is None:
        return "no pose was given"
    metres, radians = distance(pose, truth)
    if answer["status"] == "degenerate":
        dx, dy = answer["unobservable"]
        along = abs((pose["x"] - truth.x) * dx + (pose["y"] - truth.y) * dy)
        across = abs((pose["y"] - truth.y) * dx - (pose["x"] - truth.x) * dy)
        if radians > 0.5 * math.pi:
            return f"the other way round, {along:.2f} m along"
        return f"{1000 * across:.1f} mm from it across, {along:.2f} m along"
    apart = f"{1000 * metres:.1f} mm and {math.degrees(radians):.3f} deg from it"
    if answer["status"] == "ambiguous":
        if metres < NEAR:
            return f"{apart}, the first of them"
        letters = (chr(ord("A") + k) for k, one in enumerate(equals(answer)) if distance(one["pose"], truth)[0] < NEAR)
        return f"{next(letters, 'none of them')}, {metres:.2f} m from the first"
    return apart
