"""Poses on a map at which a robot can stand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, Segments
from simulation import Scanner, scan

from ..views import AnalysisError, Robot
from .reach import Reach

PLACES = 400  # over the map's box, if no spacing is given
SPACINGS = (0.3, 100.0)  # m
MOST = 50_000  # poses to try
RAYS = 72  # that look for walls around a place
CLEARANCE = 0.2  # m; a robot's distance from everything
SEEN, SEEN_UNDIRECTED = 0.2, 0.5  # least fraction of the rays that meet anything; more where walls have no free side
# Least fraction of these that meet a wall on its free side; in line maps made of logs 19 of 20 robots saw more.
FREE_SIDES = 0.6
ORDER = 20260301  # seeds the order in which places are tried

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Standing:
    """Poses to try, in an order that covers the map however early it ends.

    Attributes
    ----------
    spacing : float
        From place to place, metres.
    poses : (n, 3) x, y, theta in the map frame; metres, radians; by place, then by heading
    order : (n,) in which to try them
    """

    spacing: float
    poses: Floats
    order: NDArray[np.int64]

    def pose(self, number: int) -> RigidTransform:
        """Return one of the poses, map_from_scan."""
        x, y, theta = (float(value) for value in self.poses[number])
        return RigidTransform(x, y, theta)


def standing_places(
    segments: Segments, robot: Robot, spacing: float | None = None, point: Sequence[float] | None = None
) -> Standing:
    """Lay a grid over a map.

    Later tests, when the places of the grid are tried, find out which of them are free.

    Parameters
    ----------
    segments : Segments
        The map.
    robot : Robot
    spacing : float or None
        Metres from place to place, 0.3 to 100; None: some 400 places over the box around the map.
    point : (x, y) or None
        Metres; only places that a robot reaches from there without crossing a wall.

    Raises
    ------
    AnalysisError
        When the spacing is out of range or makes too many places, or the point is not on the map.
    """
    corners = segments.endpoints.reshape(-1, 2)
    low, high = corners.min(axis=0), corners.max(axis=0)
    width, height = (max(float(side), 1e-3) for side in high - low)
    if spacing is None:
        spacing = min(max(round(math.sqrt(width * height / PLACES), 1), SPACINGS[0]), SPACINGS[1])
    if not SPACINGS[0] <= spacing <= SPACINGS[1]:
        raise AnalysisError(
            f"expected from {SPACINGS[0]:g} to {SPACINGS[1]:g} m, found {spacing:g}", argument="spacing"
        )
    counts = [max(1, math.floor(side / spacing)) for side in (width, height)]
    headings = robot.headings
    if counts[0] * counts[1] * len(headings) > MOST:
        least = math.sqrt(width * height * len(headings) / MOST)
        raise AnalysisError(f"expected at least {least:.1f} m on this map, found {spacing:g} m", argument="spacing")
    # Centred: as far from the box on the left as on the right.
    xs, ys = (
        edge + 0.5 * (side - (count - 1) * spacing) + spacing * np.arange(count)
        for edge, side, count in zip(low, (width, height), counts, strict=True)
    )
    places = np.stack(np.meshgrid(xs, ys, indexing="xy"), axis=-1).reshape(-1, 2)
    if point is not None:
        places = places[Reach.from_point(segments, point).includes(places)]
    poses = np.column_stack([np.repeat(places, len(headings), axis=0), np.tile(headings, len(places))])
    return Standing(spacing, poses, np.random.default_rng(ORDER).permutation(len(poses)))


def is_free(segments: Segments, pose: RigidTransform, reach: float, *, oriented: bool) -> bool:
    """Return whether a robot can stand at a pose.

    Nothing is near, enough is seen, and where directions mean something nearly all of it from its free side.

    Parameters
    ----------
    segments : Segments
    pose : RigidTransform
    reach : float
        Range of the scanner, metres.
    oriented : bool
    """
    seen = scan(segments, pose, Scanner(beams=RAYS, angle_increment=math.tau / RAYS, range_max=reach, sigma=0.0))
    met = seen.hits >= 0
    if seen.true_ranges.min() < CLEARANCE or met.mean() < (SEEN if oriented else SEEN_UNDIRECTED):
        return False
    return not oriented or bool(seen.facing[met].mean() >= FREE_SIDES)
