"""Compiled comparison of what is seen with what the map says should be seen. See `_match_kernels` for the arrays."""

import math

import numpy as np

from registration.compiling import kernel

from ._sight_kernels import first_hit

RAYS = 120
TOLERANCE = 0.2  # m; a scan segment and a wall nearer to each other than that, and
TOLERANCE_SHARE = 0.02  # of the distance more, agree
FAR = 25.0  # m; farther walls are looked for only as far as one and a half times the scan reaches
MISSING_RANGE = 15.0  # m; a wall nearer than that, within the reach of the scan,
MISSING_LENGTH = 0.8  # m; as long,
MISSING_SINE = 0.3  # and not seen at a grazing angle, should have left a segment
BLIND_SHARE = 0.25  # of the circle; a wider gap without any segment is out of the sensor's view
NEUTRAL = 0.8  # where there is nothing to compare


@kernel
def scan_distances(scan, x, y, distances):
    """Write the distance from ``(x, y)`` in the scan frame to the first segment along each ray, inf where none is."""
    rays = len(distances)
    farthest = 0.0
    for k in range(rays):
        angle = 2.0 * math.pi * (k + 0.5) / rays
        dx = math.cos(angle)
        dy = math.sin(angle)
        distances[k] = math.inf
        for i in range(len(scan)):
            across = dx * scan[i, 1] - dy * scan[i, 0]
            if abs(across) < 1e-9:
                continue
            mx = scan[i, 2] - x
            my = scan[i, 3] - y
            reach = (mx * scan[i, 1] - my * scan[i, 0]) / across
            along = (mx * dy - my * dx) / across
            if reach > 0.0 and abs(along) <= 0.5 * scan[i, 4] and reach < distances[k]:
                distances[k] = reach
    for i in range(len(scan)):
        farthest = max(farthest, math.hypot(scan[i, 2] - x, scan[i, 3] - y) + 0.5 * scan[i, 4])
    return farthest


@kernel
def in_view(distances, view):
    """Tell of each ray whether the sensor looked there: all but the widest gap without segments, if that is wide."""
    rays = len(distances)
    view[:] = True
    last = -1
    first = -1
    for k in range(rays):
        if distances[k] < math.inf:
            first = k if first < 0 else first
            last = k
    if first < 0:
        return
    widest = first + rays - last
    after = last
    before = first
    for k in range(first + 1, last + 1):
        if distances[k] < math.inf:
            if k - before > widest:
                widest = k - before
                after = before
            before = k
    if widest > BLIND_SHARE * rays:
        for step in range(1, widest):
            view[(after + step) % rays] = False


@kernel
def agreement(scan, x, y, theta, tx, ty, walls, starts, items, shape):
    """Return of the directions that tell something the share in which the scan shows what the map does, 0 to 1.

    Rays from the sensor at ``(x, y)`` in the scan frame. For: the first segment and the first wall are as far away.
    Against: the wall is before the segment, or there is none where the wall should have left one. What stands before a
    wall tells nothing.
    """
    distances = np.empty(RAYS)
    view = np.empty(RAYS, dtype=np.bool_)
    farthest = scan_distances(scan, x, y, distances)
    in_view(distances, view)
    c = math.cos(theta)
    s = math.sin(theta)
    px = c * x - s * y + tx
    py = s * x + c * y + ty
    limit = max(FAR, 1.5 * farthest)
    agree = 0
    against = 0
    for k in range(RAYS):
        if not view[k]:
            continue
        angle = 2.0 * math.pi * (k + 0.5) / RAYS + theta
        dx = math.cos(angle)
        dy = math.sin(angle)
        reach, w = first_hit(px, py, dx, dy, limit, walls, starts, items, shape)
        if w < 0:
            continue
        if distances[k] < math.inf:
            tolerance = TOLERANCE + TOLERANCE_SHARE * distances[k]
            if abs(distances[k] - reach) < tolerance:
                agree += 1
            elif reach < distances[k]:
                against += 1
        elif (
            reach < min(farthest, MISSING_RANGE)
            and walls[w, 4] - walls[w, 3] > MISSING_LENGTH
            and abs(walls[w, 0] * dy - walls[w, 1] * dx) > MISSING_SINE
        ):
            against += 1
    return agree / (agree + against) if agree + against > 0 else NEUTRAL
