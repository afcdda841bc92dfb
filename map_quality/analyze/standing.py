"""Poses on a map at which a robot can stand, and the cells that it reaches from a point without crossing a wall."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from registration import RigidTransform, Segments
from registration.layout import Floats
from simulation import Scanner, scan

from ..views import AnalysisError, Robot

PLACES = 400  # over the map's box, if no spacing is given
SPACINGS = (0.3, 100.0)  # m
MOST = 50_000  # poses to try
RAYS = 72  # that look for walls around a place
CLEARANCE = 0.2  # m; a robot's distance from everything
SEEN, SEEN_UNDIRECTED = 0.2, 0.5  # least fraction of the rays that meet anything; more where walls have no free side
# Least fraction of these that meet a wall on its free side; in line maps made of logs 19 of 20 robots saw more.
FREE_SIDES = 0.6
CELL = 0.1  # m; fine enough for doors
MOST_CELLS = 4_000_000
MOST_STEPS = 20_000_000  # along the walls
ORDER = 20260301  # seeds the order in which places are tried


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
        return RigidTransform(*self.poses[number].tolist())


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
        places = places[reached(segments, point, places)]
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


def reached(segments: Segments, point: Sequence[float], places: Floats) -> NDArray[np.bool_]:
    """Return which of ``(n, 2)`` places on a map are reached from a point, ``(x, y)`` metres, without crossing a wall.

    Raises
    ------
    AnalysisError
        When the point lies outside the box around the map, or on a wall, or the map has too much wall for it.
    """
    corners = segments.endpoints.reshape(-1, 2)
    low, high = corners.min(axis=0), corners.max(axis=0)
    cell = max(CELL, math.sqrt(float(np.prod(high - low)) / MOST_CELLS))
    steps = int(np.ceil(segments.lengths / (0.5 * cell)).sum())
    if steps > MOST_STEPS:
        raise AnalysisError(
            f"expected a smaller map for an analysis from a point: its walls cover {steps} cells of at most "
            f"{MOST_STEPS}; omit the point, or cut the map",
            argument="point",
        )
    start = np.asarray(point, dtype=np.float64)
    away = float(np.linalg.norm(np.maximum(0.0, np.maximum(low - cell - start, start - high))))
    if not away <= 0.0:
        raise AnalysisError(f"expected a place on the map, found one {away:.2f} m outside", argument="point")

    def cells(points: Floats) -> tuple[NDArray[np.int64], ...]:
        return tuple(np.floor((points - low) / cell).astype(np.int64).T + 1)

    walls = np.zeros(np.ceil((high - low) / cell).astype(int) + 3, dtype=bool)
    walls[cells(segments.points(0.5 * cell))] = True
    labels, _ = scipy.ndimage.label(~walls)
    label = labels[cells(start)]
    if label == 0:
        raise AnalysisError(
            f"expected a free place, found one on a wall; choose one {cell:.2f} m away", argument="point"
        )
    return np.asarray(labels[cells(places)] == label)
