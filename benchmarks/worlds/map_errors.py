"""Errors of a map relative to its building."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, Segments

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

ANGLE = 1e-6  # rad; pieces of one wall differ less in direction,
OFFSET = 1e-5  # m; in their lines,
GAP = 1.5  # m; and lie no farther apart: a doorway may be between them

PIECE = (0.4, 3.0)  # m; of a wall that is cut
FARTHEST = 50.0  # m; of a map's origin from the building's


@dataclass(frozen=True, slots=True)
class DrawnMap:
    """A map, and where in it the building lies: ``p_map = linear p_building + shift``, errors of single walls apart.

    Attributes
    ----------
    segments : Segments
        Metres in the map frame.
    linear : (2, 2)
    shift : (2,) metres
    """

    segments: Segments
    linear: Floats
    shift: Floats

    def pose(self, building_from_scan: RigidTransform) -> RigidTransform:
        """Return a pose in the building as a pose in the map: where the map is best in accord with what is seen."""
        x, y = self.linear @ [building_from_scan.x, building_from_scan.y] + self.shift
        turn = math.atan2(self.linear[1, 0] - self.linear[0, 1], self.linear[0, 0] + self.linear[1, 1])
        return RigidTransform(float(x), float(y), building_from_scan.theta + turn)

    def laid(self, rng: np.random.Generator) -> DrawnMap:
        """Return the map in a frame of its own: turned by any angle, its origin anywhere within some distance."""
        angle = rng.uniform(-math.pi, math.pi)
        rotation = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        shift = rng.uniform(-FARTHEST, FARTHEST, 2)
        segments = _transformed(self.segments, rotation, shift)
        return DrawnMap(segments, rotation @ self.linear, rotation @ self.shift + shift)


def exact(segments: Segments, _rng: np.random.Generator) -> DrawnMap:
    """Return a map without errors."""
    return DrawnMap(segments, np.eye(2), np.zeros(2))


def stretched(segments: Segments, linear: Floats) -> DrawnMap:
    """Return a map to another scale, or sheared: ``linear`` is a matrix near the identity."""
    return DrawnMap(_transformed(segments, linear, np.zeros(2)), linear, np.zeros(2))


def walls_off(segments: Segments, rng: np.random.Generator, sigma: float) -> DrawnMap:
    """Return a map whose walls are off along their normals, pieces of a wall together.

    Parameters
    ----------
    segments : Segments
    rng : numpy.random.Generator
    sigma : float
        Standard deviation, metres.
    """
    walls = wall_of_segment(segments)
    errors = rng.normal(0.0, sigma, walls.max(initial=-1) + 1)[walls]
    return exact(Segments.from_array(segments.endpoints + np.tile(errors[:, None] * segments.normals, 2)), rng)


def in_pieces(segments: Segments, rng: np.random.Generator, sigma: float) -> DrawnMap:
    """Return a map whose walls are off as in `walls_off` and cut into pieces without gaps."""
    whole = walls_off(segments, rng, sigma).segments
    pieces = []
    for begin, direction, length in zip(whole.endpoints[:, :2], whole.directions, whole.lengths, strict=True):
        cuts = [0.0]
        while length - cuts[-1] > PIECE[1]:
            cuts.append(cuts[-1] + rng.uniform(*PIECE))
        s = np.array([*cuts, length])
        pieces.append(np.hstack([begin + s[:-1, None] * direction, begin + s[1:, None] * direction]))
    return exact(Segments.from_array(np.vstack(pieces)), rng)


def clipped(segments: Segments, normal: Floats, limit: float) -> Segments:
    """Return what of the segments lies where ``normal . p <= limit``; what is cut to less than 1 cm is gone."""
    e = segments.endpoints
    begin, end = e[:, :2] @ normal - limit, e[:, 2:] @ normal - limit
    whole = (begin <= 0.0) & (end <= 0.0)
    cut = begin * end < 0.0
    share = begin[cut] / (begin[cut] - end[cut])
    across = e[cut, :2] + share[:, None] * (e[cut, 2:] - e[cut, :2])
    inside = (begin[cut] <= 0.0)[:, None]
    kept = np.where(inside, np.hstack([e[cut, :2], across]), np.hstack([across, e[cut, 2:]]))
    kept = kept[np.hypot(kept[:, 2] - kept[:, 0], kept[:, 3] - kept[:, 1]) > 0.01]
    return Segments.from_array(np.vstack([e[whole], kept]))


def _transformed(segments: Segments, linear: Floats, shift: Floats) -> Segments:
    return Segments.from_array((segments.endpoints.reshape(-1, 2) @ linear.T + shift).reshape(-1, 4))


def wall_of_segment(segments: Segments) -> Indices:
    """Return for each segment the number of its wall, ``(n,)`` from 0 up; pieces of a wall share one line."""
    if len(segments) == 0:
        return np.zeros(0, dtype=np.int64)
    angles = np.arctan2(segments.directions[:, 1], segments.directions[:, 0])
    heading = np.round(angles / ANGLE) % round(math.tau / ANGLE)
    line = np.round(segments.offsets / OFFSET)
    begin = np.einsum("ij,ij->i", segments.endpoints[:, :2], segments.directions)
    order = np.lexsort([begin, line, heading])
    ends = begin + segments.lengths
    walls, count, reach = np.zeros(len(segments), dtype=np.int64), -1, -math.inf
    for k, here in enumerate(order):
        before = order[k - 1]
        along = k > 0 and heading[here] == heading[before] and line[here] == line[before]
        if not along or begin[here] > reach + GAP:
            count, reach = count + 1, -math.inf
        reach = max(reach, float(ends[here]))
        walls[here] = count
    return walls
