"""Compare the view of the scan with that of the map."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...layout import Flags
from ...tables import Place, Sights, Workspace
from ...tuning import FAR, FARTHER, RAYS
from ..tuning import AGREEING, AGREEING_FRACTION, BLIND_FRACTION, MISSING_LENGTH, MISSING_RANGE, MISSING_SINE, NEUTRAL
from .sight import first_hit


@kernel
def scan_distances(scan: Records, x: float, y: float, distances: Floats) -> float:
    """Write the distance from ``(x, y)`` in the scan frame to the first segment along each ray, inf where none is.

    Returns how far the scan reaches.
    """
    rays = len(distances)
    farthest = 0.0
    for k in range(rays):
        angle = 2.0 * math.pi * (k + 0.5) / rays
        dx = math.cos(angle)
        dy = math.sin(angle)
        distances[k] = math.inf
        for i in range(len(scan)):
            across = dx * scan[i].dy - dy * scan[i].dx
            if abs(across) < 1e-9:
                continue
            mx = scan[i].x - x
            my = scan[i].y - y
            reach = (mx * scan[i].dy - my * scan[i].dx) / across
            along = (mx * dy - my * dx) / across
            if reach > 0.0 and abs(along) <= 0.5 * scan[i].length and reach < distances[k]:
                distances[k] = reach
    for i in range(len(scan)):
        farthest = max(farthest, math.hypot(scan[i].x - x, scan[i].y - y) + 0.5 * scan[i].length)
    return farthest


@kernel
def in_view(distances: Floats, view: Flags) -> None:
    """Write for each ray whether the sensor looked there: all but the widest gap without segments, if that is wide."""
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
    if widest > BLIND_FRACTION * rays:
        for step in range(1, widest):
            view[(after + step) % rays] = False


@kernel
def agreement(sights: Sights, pose: Records, place: Place, work: Workspace) -> float:
    """Return of the directions with evidence the fraction in which the scan shows what the map does, 0 to 1.

    Rays from the sensor of each view. For: the first segment and the first wall are as far away. Against: the wall is
    before the segment, or there is no segment although the wall should have left one. Segments before a wall count for
    neither. Each view counts with its weight.
    `pose` (1,).
    """
    walls = place.walls
    starts = place.grid.starts
    items = place.grid.items
    shape = place.grid.shape[0]
    ray = work.scratch[0].ray
    at = pose[0]
    distances = np.empty(RAYS, np.float64)
    looked = np.empty(RAYS, np.bool_)
    c = math.cos(at.theta)
    s = math.sin(at.theta)
    agree = 0.0
    against = 0.0
    for v in range(len(sights.places)):
        sensor = sights.places[v]
        weight = sights.weights[v]
        seen = sights.seen[sights.starts[v] : sights.starts[v + 1]]
        farthest = scan_distances(seen, sensor.x, sensor.y, distances)
        in_view(distances, looked)
        ray.x = c * sensor.x - s * sensor.y + at.x
        ray.y = s * sensor.x + c * sensor.y + at.y
        ray.limit = max(FAR, FARTHER * farthest)
        for k in range(RAYS):
            if not looked[k]:
                continue
            angle = 2.0 * math.pi * (k + 0.5) / RAYS + at.theta
            dx = math.cos(angle)
            dy = math.sin(angle)
            ray.dx = dx
            ray.dy = dy
            reach, w = first_hit(ray, walls, starts, items, shape)
            if w < 0:
                continue
            if distances[k] < math.inf:
                tolerance = AGREEING + AGREEING_FRACTION * distances[k]
                if abs(distances[k] - reach) < tolerance:
                    agree += weight
                elif reach < distances[k]:
                    against += weight
            elif reach < farthest and leaves_segment(walls[w], reach, dx, dy):
                against += weight
    return agree / (agree + against) if agree + against > 0.0 else NEUTRAL


@kernel
def leaves_segment(wall: Record, reach: float, dx: float, dy: float) -> bool:
    """Return whether a wall that a ray meets should leave a segment: near, long, and not seen at a grazing angle."""
    if reach >= MISSING_RANGE or wall.end - wall.begin <= MISSING_LENGTH:
        return False
    return abs(wall.dx * dy - wall.dy * dx) > MISSING_SINE
