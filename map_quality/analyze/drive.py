"""Drives of a robot that is not localized, and its scans on the way."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from association import Scan, View, assemble
from registration import IDENTITY, RigidTransform, Segments, wrap_angle
from registration.layout import Floats
from simulation import Scanner, scan

STEP = 1.0  # m from view to view
# Standard deviations of odometry on a step: m, m, rad. As of wheels that are not looked after.
ODOMETRY = (0.02, 0.02, 0.02)
CLEARANCE = 0.3  # m; its distance from everything ahead
RAYS = 72  # that feel for where there is room
BESIDE = 2  # rays on either side that have to have room, too
ANGLES = -math.pi + math.tau / RAYS * np.arange(RAYS)
TURN = math.radians(120.0)  # the most that it turns where it cannot go on; back only where there is nothing else


def ways_from(
    segments: Segments, pose: RigidTransform, metres: float, reach: float
) -> tuple[Iterator[RigidTransform], Iterator[RigidTransform]]:
    """Yield the poses of two drives, a step apart, without the first; a drive ends early where there is no room.

    On one the robot sets out to where most room is, on the other to where most room is on the other side. It keeps
    straight on as long as it can, and then turns to where most room is.

    Parameters
    ----------
    segments : Segments
        The map.
    pose : RigidTransform
        The start of the drive, map_from_robot.
    metres : float
        The longest way.
    reach : float
        Range of the rays that look for room, metres.
    """
    steps = math.floor(metres / STEP + 1e-9)
    room = _room(segments, pose, reach)
    first = _most(room)
    other = None if first is None else _most(np.where(_away(first) > 0.5 * math.pi, room, -np.inf))
    return _way(segments, pose, first, steps, reach), _way(segments, pose, other, steps, reach)


def _way(
    segments: Segments, pose: RigidTransform, ahead: float | None, steps: int, reach: float
) -> Iterator[RigidTransform]:
    for _ in range(steps):
        if ahead is None:
            return
        pose = RigidTransform(pose.x + STEP * math.cos(ahead), pose.y + STEP * math.sin(ahead), wrap_angle(ahead))
        yield pose
        ahead = _next(_room(segments, pose, reach), ahead)


def _room(segments: Segments, pose: RigidTransform, reach: float) -> Floats:
    """Return how far there is room along each of the rays, by their angle in the map from -pi up; metres."""
    feeling = Scanner(RAYS, float(ANGLES[0]), math.tau / RAYS, range_max=reach, sigma=0.0)
    free = np.minimum(scan(segments, RigidTransform(pose.x, pose.y, 0.0), feeling).true_ranges, reach)
    room: Floats = np.min([np.roll(free, k) for k in range(-BESIDE, BESIDE + 1)], axis=0) - CLEARANCE
    return room


def _next(room: Floats, ahead: float) -> float | None:
    """Return where to go on from here, None where there is no room."""
    away = _away(ahead)
    if room[int(np.argmin(away))] >= STEP:
        return ahead
    sideways = _most(np.where(away <= TURN, room, -np.inf))
    return _most(room) if sideways is None else sideways


def _most(room: Floats) -> float | None:
    best = int(np.argmax(room))
    return float(ANGLES[best]) if room[best] >= STEP else None


def _away(angle: float) -> Floats:
    """Return by how much each of the rays is turned away from an angle, radians."""
    turned: Floats = np.abs(np.remainder(ANGLES - angle + math.pi, math.tau) - math.pi)
    return turned


def seen_on_the_way(views: Sequence[tuple[RigidTransform, Scan]], rng: np.random.Generator) -> Scan:
    """Join the scans at the poses of a drive, in the frame of the last, by odometry with its errors.

    Parameters
    ----------
    views : sequence of (pose, scan)
        Each map_from_robot, and in its own frame.
    rng : numpy.random.Generator
        Draws the errors.
    """
    covariance = np.diag(np.square(ODOMETRY))
    last = len(views) - 1
    pose = IDENTITY
    steps = rng.normal(0.0, ODOMETRY, (last, 3))
    out = [View(views[last][1])]
    for k in reversed(range(last)):
        step = views[k + 1][0].inverse().compose(views[k][0])
        x, y, theta = steps[k]
        pose = pose.compose(RigidTransform(step.x + x, step.y + y, wrap_angle(step.theta + theta)))
        out.append(View(views[k][1], pose, covariance, len(out) - 1))
    return assemble(out)
