"""Compiling, or loading from the cache, what the first request would otherwise wait for."""

from __future__ import annotations

import numpy as np

from association import AssociationOptions, Beams, Deadline, HardPrior, MapIndex, Scan, SoftPrior, associate
from association.checking import check_map, try_sample
from registration import MeasuredSegments, RegistrationOptions, RigidTransform, Segments, register
from vectorization import LaserScan, vectorize

# A room with a niche, seen from inside: free space on the left of every wall.
ROOM = np.array(
    [
        [-4.0, -3.0, 4.0, -3.0],
        [4.0, -3.0, 4.0, 1.0],
        [4.0, 1.0, 2.5, 1.0],
        [2.5, 1.0, 2.5, 3.0],
        [2.5, 3.0, -4.0, 3.0],
        [-4.0, 3.0, -4.0, -3.0],
    ]
)
# As another, but symmetric about an axis: seen from there, the mirrored scan is found as well.
SYMMETRIC_ROOM = np.array(
    [
        [-4.0, -3.0, 4.0, -3.0],
        [4.0, -3.0, 4.0, 3.0],
        [4.0, 3.0, 1.0, 3.0],
        [1.0, 3.0, 1.0, 1.5],
        [1.0, 1.5, -1.0, 1.5],
        [-1.0, 1.5, -1.0, 3.0],
        [-1.0, 3.0, -4.0, 3.0],
        [-4.0, 3.0, -4.0, -3.0],
    ]
)

MANY_ROOMS = 250


def warm_up() -> None:
    """Register, vectorize, associate and check a map once in each way that has kernels of its own."""
    room = Segments.from_array(ROOM)
    measured = MeasuredSegments.from_segments(room)
    pairs = np.repeat(np.arange(len(room))[:, None], 2, axis=1)
    for options in (
        RegistrationOptions(),
        RegistrationOptions(estimator="one_step", rotation="mitsuta", oriented=False),
        RegistrationOptions(estimator="one_step", evaluate_at=RigidTransform(0.0, 0.0, 0.0)),
    ):
        register(room, measured, pairs, 0.0, options)
    turn = np.linspace(-np.pi, np.pi, 360, endpoint=False)
    ranges = room_ranges(turn)
    seen = vectorize(LaserScan(-np.pi, turn[1] - turn[0], ranges, 0.1, 30.0))
    points = np.stack([ranges * np.cos(turn), ranges * np.sin(turn)], axis=1)
    vectorize(points)
    vectorize(points, viewpoint=None)
    index = MapIndex.build(room, 0.0)
    pose = RigidTransform(0.0, 0.0, 0.0)
    beams = Scan(seen.measured, (0.0, 0.0), Beams(seen.angles, seen.ranges, seen.range_max))
    for scan, prior, how in (
        (Scan(measured), None, AssociationOptions()),
        (beams, SoftPrior(pose, np.eye(3)), AssociationOptions()),
        (Scan(measured, None), HardPrior(pose, 1.0, 1.0), AssociationOptions(oriented=False)),
    ):
        associate(index, scan, prior, how, Deadline())
    symmetric = Segments.from_array(SYMMETRIC_ROOM)
    alone = Scan(MeasuredSegments.from_segments(symmetric), (0.0, 0.0))
    associate(MapIndex.build(symmetric, 0.0), alone, None, AssociationOptions(), Deadline())
    MapIndex.build(Segments.from_array(rooms(MANY_ROOMS)))  # so large that more of it is listed
    check_map(index)
    one_wall = Scan(MeasuredSegments.from_segments(room.take([0])))  # never usable: mistakes are looked for
    for scan in (beams, one_wall):
        try_sample(index, scan, Deadline(), oriented=True)


def rooms(count: int) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Return the walls of so many rooms in a row, 20 m apart."""
    return np.vstack([ROOM + np.tile([20.0 * k, 0.0], 2) for k in range(count)])


def room_ranges(angles: np.ndarray[tuple[int], np.dtype[np.float64]]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """Return the distance from the origin to the room's walls along each angle, metres."""
    nearest = np.full(len(angles), np.inf)
    for x1, y1, x2, y2 in ROOM:
        ex, ey = x2 - x1, y2 - y1
        cross = np.cos(angles) * ey - np.sin(angles) * ex
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (x1 * ey - y1 * ex) / cross
            share = (x1 * np.sin(angles) - y1 * np.cos(angles)) / cross
        hit = (np.abs(cross) > 1e-12) & (along > 0.0) & (share >= 0.0) & (share <= 1.0)
        nearest = np.where(hit, np.minimum(nearest, along), nearest)
    return nearest
