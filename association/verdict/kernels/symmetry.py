"""Test a map for mirror symmetry: compare its view from one pose, mirrored, with that from another."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Record, Records

from ...consensus.kernels.matching import allow_all, match_scan
from ...consensus.kernels.sight import first_hit
from ...layout import MATCH, SCAN_LINE
from ...tables import Place, Workspace
from ...tuning import GAIN, GAIN_LENGTH, GAIN_PER_METRE, MODEL_ANGLE, MODEL_OFFSET, RAYS
from ..tuning import SHORTEST_SHOWN


@kernel
def shown_walls(
    view: Record, pose: Record, place: Place, reach: float, ray: Record, lows: Floats, highs: Floats
) -> None:
    """Widen for each wall the abscissae between which it is seen, `lows` above `highs` where it is not, by one view.

    Both (m,), by wall. Rays from where the sensor stands at a pose, as far as `reach` metres.
    """
    walls = place.walls
    starts = place.grid.starts
    items = place.grid.items
    shape = place.grid.shape[0]
    c = math.cos(pose.theta)
    s = math.sin(pose.theta)
    ray.x = c * view.x - s * view.y + pose.x
    ray.y = s * view.x + c * view.y + pose.y
    ray.limit = reach
    for k in range(RAYS):
        angle = 2.0 * math.pi * (k + 0.5) / RAYS
        ray.dx = math.cos(angle)
        ray.dy = math.sin(angle)
        distance, w = first_hit(ray, walls, starts, items, shape)
        if w >= 0:
            along = walls[w].dx * (ray.x + distance * ray.dx) + walls[w].dy * (ray.y + distance * ray.dy)
            lows[w] = min(lows[w], along)
            highs[w] = max(highs[w], along)


@kernel
def mirror_walls(pose: Record, walls: Records, lows: Floats, highs: Floats) -> Records:
    """Return the walls that are seen from a pose as a scan with left and right exchanged, (n,) of `SCAN_LINE`."""
    count = 0
    for w in range(len(walls)):
        if highs[w] - lows[w] > SHORTEST_SHOWN:
            count += 1
    out = np.zeros(count, SCAN_LINE)
    c = math.cos(pose.theta)
    s = math.sin(pose.theta)
    k = 0
    for w in range(len(walls)):
        if highs[w] - lows[w] > SHORTEST_SHOWN:
            one = out[k]
            k += 1
            wall = walls[w]
            middle = 0.5 * (lows[w] + highs[w])
            x = wall.dx * middle - wall.dy * wall.offset - pose.x
            y = wall.dy * middle + wall.dx * wall.offset - pose.y
            # From the map's frame to the scan's, y becomes -y, and the direction turns round.
            one.x = c * x + s * y
            one.y = s * x - c * y
            one.dx = -(c * wall.dx + s * wall.dy)
            one.dy = c * wall.dy - s * wall.dx
            one.length = highs[w] - lows[w]
            one.angle = math.atan2(one.dy, one.dx)
            one.offset_variance = MODEL_OFFSET**2
            one.angle_variance = MODEL_ANGLE**2
            one.gain = GAIN + GAIN_PER_METRE * min(one.length, GAIN_LENGTH)
    return out


@kernel
def reach_of(places: Records, seen: Records) -> float:
    """Return how far anything lies from where it was seen, metres.

    `places` (v,) of `POINT`, `seen` (k,) of `SIGHTING`.
    """
    farthest = 0.0
    for i in range(len(seen)):
        one = seen[i]
        at = places[one.sensor]
        farthest = max(farthest, math.hypot(one.x - at.x, one.y - at.y) + 0.5 * one.length)
    return farthest


@kernel
def mirrored_fraction(
    views: Records, seen: Records, pose: Records, null: Records, gates: Records, place: Place, work: Workspace
) -> float:
    """Return the fraction of the map's view from `pose` that it shows mirrored from `null`, 0 to 1; both (1,).

    From the places (v,) of `views` together, as far as what was `seen`, (k,) of `SIGHTING`: the fraction of the gains
    of the walls that are seen, each matched as a scan line would be.
    """
    lows = np.full(len(place.walls), math.inf)
    highs = np.full(len(place.walls), -math.inf)
    reach = reach_of(views, seen)
    for v in range(len(views)):
        shown_walls(views[v], pose[0], place, reach, work.scratch[0].ray, lows, highs)
    lines = mirror_walls(pose[0], place.walls, lows, highs)
    matches = np.zeros(len(lines), MATCH)
    total = 0.0
    for k in range(len(lines)):
        total += lines[k].gain
    if total == 0.0:
        return 0.0
    possible = np.empty(len(lines), np.float64)
    allow_all(lines, possible)
    return match_scan(lines, null[0], place, gates[0], possible, 0.0, matches) / total
