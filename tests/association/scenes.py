"""Scans with known answers: pieces of a map's walls, moved to the sensor's frame, with noise and clutter."""

import math

import numpy as np

from association import Scan
from registration import MeasuredSegments, RigidTransform, Segments

# An L-shaped room with a niche: no turn or shift of it looks like itself.
ROOM = np.array(
    [
        [0.0, 0.0, 9.0, 0.0],
        [9.0, 0.0, 9.0, 4.0],
        [9.0, 4.0, 5.0, 4.0],
        [5.0, 4.0, 5.0, 7.0],
        [5.0, 7.0, 2.0, 7.0],
        [2.0, 7.0, 2.0, 5.5],
        [2.0, 5.5, 0.0, 5.5],
        [0.0, 5.5, 0.0, 0.0],
    ]
)
SQUARE = np.array([[0, 0, 5, 0], [5, 0, 5, 5], [5, 5, 0, 5], [0, 5, 0, 0]], dtype=float)
CORRIDOR = np.array([[0, 0, 30, 0], [30, 2, 0, 2]], dtype=float)


def maze(seed, n=60, size=30.0):
    """Draw n walls along two directions, in no order that repeats."""
    rng = np.random.default_rng(seed)
    begins = rng.uniform(0.0, size, (n, 2))
    lengths = rng.uniform(0.8, 6.0, n)
    turns = rng.integers(0, 4, n) * (math.pi / 2)
    ends = begins + lengths[:, None] * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    return np.hstack([begins, ends])


def seen(walls, pose, *, noise=0.0, cut=0.0, clutter=0, seed=0, radius=math.inf):
    """Return (endpoints in the scan frame, truth), truth the wall of each segment or -1 for clutter.

    Of every wall within `radius` of the pose a share from ``1 - cut`` to 1 is seen.
    """
    rng = np.random.default_rng(seed)
    walls = np.asarray(walls, dtype=float)
    middle = 0.5 * (walls[:, :2] + walls[:, 2:])
    near = np.nonzero(np.hypot(middle[:, 0] - pose.x, middle[:, 1] - pose.y) <= radius)[0]
    pieces = []
    for i in near:
        share = 1.0 - cut * rng.random()
        start = (1.0 - share) * rng.random()
        a, d = walls[i, :2], walls[i, 2:] - walls[i, :2]
        n = np.array([-d[1], d[0]]) / np.hypot(*d)
        ends = [a + start * d + noise * rng.normal() * n, a + (start + share) * d + noise * rng.normal() * n]
        pieces.append(np.concatenate(ends))
    for _ in range(clutter):
        begin = np.array([pose.x, pose.y]) + rng.uniform(-6.0, 6.0, 2)
        turn = rng.uniform(-math.pi, math.pi)
        pieces.append(
            np.concatenate([begin, begin + rng.uniform(0.5, 2.0) * np.array([math.cos(turn), math.sin(turn)])])
        )
    truth = np.concatenate([near, np.full(clutter, -1)])
    order = rng.permutation(len(pieces))
    local = pose.inverse().apply(np.array(pieces).reshape(-1, 2, 2)).reshape(-1, 4)
    return local[order], truth[order]


def scan_of(endpoints, sigma=0.02, **options):
    """Wrap scan-frame endpoints; by default not seen from one place, since `seen` lets every wall be seen."""
    options.setdefault("viewpoint", None)
    return Scan(MeasuredSegments.from_segments(Segments.from_array(endpoints), sigma), **options)


def same_pose(a, b, distance=0.1, angle=0.0175):
    turn = math.remainder(a.theta - b.theta, math.tau)
    return math.hypot(a.x - b.x, a.y - b.y) <= distance and abs(turn) <= angle


def pose(x=0.0, y=0.0, theta=0.0):
    return RigidTransform(x, y, theta)
