"""Compiled evidence of single beams: what a laser should read at a pose, and what it did. See `_match_kernels`."""

import math

import numpy as np

from registration import kernels
from registration.compiling import kernel
from registration.layout import JOINT_SUMS, SEEN

from ._joint_kernels import WALL, joint_solve
from ._match_kernels import hold
from ._sight_kernels import first_hit

NEAR = 0.1  # m; standard deviation of a reading across the wall it should come from: noise, map and pose together
CERTAIN = 0.15  # m; a reading farther across than this is not of that wall
LEAST_INCIDENCE = 0.15  # cosine; nearer to grazing the pose decides too much
LEAST_POINTS = 10  # for the beams to move a pose
SURE_LENGTH = 3.0  # m; shorter walls on a map made by a robot may have been people or carts


@kernel
def beam_evidence(angles, ranges, reach, viewpoint, pose, walls, starts, items, shape):
    """Return the shares of the beams that read the wall they should and that passed through one.

    `angles`, `ranges` (m,): scan frame, inf where nothing was met within `reach` metres. A beam that ends before the
    wall proves nothing: people and boxes stand in front of walls. One without a return proves little, black or mirror
    walls give none.
    """
    c = math.cos(pose[0])
    s = math.sin(pose[0])
    x = c * viewpoint[0] - s * viewpoint[1] + pose[1]
    y = s * viewpoint[0] + c * viewpoint[1] + pose[2]
    read = 0.0
    passed = 0.0
    for i in range(len(angles)):
        dx = math.cos(pose[0] + angles[i])
        dy = math.sin(pose[0] + angles[i])
        if math.isinf(ranges[i]):
            continue
        expected, w = first_hit(x, y, dx, dy, min(reach, ranges[i] + 2.0), walls, starts, items, shape)
        if w < 0:
            continue
        incidence = max(LEAST_INCIDENCE, abs(walls[w, 0] * dy - walls[w, 1] * dx))
        across = (ranges[i] - expected) * incidence
        read += math.exp(-0.5 * across * across / (NEAR * NEAR))
        if across > CERTAIN:
            passed += min(1.0, (walls[w, 4] - walls[w, 3]) / SURE_LENGTH)
    n = max(1, len(angles))
    return read / n, passed / n


@kernel
def refine_by_beams(angles, ranges, viewpoint, pose, walls, starts, items, shape, gate, sums):
    """Move `pose` to where the ends of the beams lie on the walls nearest to them, up to `gate` metres off.

    One round of point-to-line least squares by the same sums; a point is a pair without spread. A direction that no
    wall fixes is held where it is.
    """
    sums[:] = 0.0
    lines = walls.view(WALL)
    points = np.zeros(1, SEEN)
    point = points[0]
    point.dx = 1.0
    c = math.cos(pose[0])
    s = math.sin(pose[0])
    for i in range(len(angles)):
        if math.isinf(ranges[i]):
            continue
        px = viewpoint[0] + ranges[i] * math.cos(angles[i])
        py = viewpoint[1] + ranges[i] * math.sin(angles[i])
        x = c * px - s * py + pose[1]
        y = s * px + c * py + pose[2]
        fx = (x - shape[0]) / shape[2]
        fy = (y - shape[1]) / shape[2]
        if not (fx >= 0.0 and fy >= 0.0 and fx < shape[3] and fy < shape[4]):
            continue
        here = int(fy) * int(shape[3]) + int(fx)
        nearest = -1
        least = gate
        for k in range(starts[here], starts[here + 1]):
            w = items[k]
            along = walls[w, 0] * x + walls[w, 1] * y
            off = abs(walls[w, 0] * y - walls[w, 1] * x - walls[w, 2])
            if off < least and along >= walls[w, 3] - NEAR and along <= walls[w, 4] + NEAR:
                least = off
                nearest = w
        if nearest >= 0:
            point.centroid_x = px
            point.centroid_y = py
            kernels.joint_add(sums.view(JOINT_SUMS)[0], lines[nearest, 0], point, 1.0, 1.0)
    kernels.keep_alive(points)
    if sums[17] < LEAST_POINTS:
        return
    hold(sums, pose[1], pose[2], 1.0)
    theta, tx, ty, _, _ = joint_solve(sums, pose[0], False)
    pose[0] = theta
    pose[1] = tx
    pose[2] = ty


@kernel
def rank_beams(angles, ranges, reach, viewpoint, poses, walls, starts, items, shape, refined, out):
    """Write the evidence of the beams, shares read and passed, for each of the poses (k, 3) to `out` (k, 2).

    The first `refined` poses are moved to where the beams fit best, if they fit better there.
    """
    sums = np.empty(18)
    moved = np.empty(3)
    for k in range(len(poses)):
        read, passed = beam_evidence(angles, ranges, reach, viewpoint, poses[k], walls, starts, items, shape)
        if k < refined:
            moved[:] = poses[k]
            for gate in (0.35, 0.25, 0.15, 0.15):
                refine_by_beams(angles, ranges, viewpoint, moved, walls, starts, items, shape, gate, sums)
            moved_read, moved_passed = beam_evidence(
                angles, ranges, reach, viewpoint, moved, walls, starts, items, shape
            )
            if moved_read > read and moved_passed <= passed + 0.01:
                read = moved_read
                passed = moved_passed
                poses[k] = moved
        out[k, 0] = read
        out[k, 1] = passed
