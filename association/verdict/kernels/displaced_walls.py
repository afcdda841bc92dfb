"""Measure how much of a scan is decimetres away from walls of the map."""

import math

from compiled import kernel
from registration.layout import Records

from ...consensus.tuning import NEAR
from ...search.tuning import PARALLEL_SINE
from ...tables import Place
from ...tuning import REACH


@kernel
def displaced_length(scan: Records, matches: Records, poses: Records, place: Place) -> float:
    """Return the length of the scan lines without a match that are parallel to a wall near them, metres.

    The middle of such a line is between the ends of the wall, and at `NEAR` to `REACH` from its line.
    `scan` (n,), `matches` (n,) of `MATCH`, `poses` (1,) in the index frame.
    """
    walls = place.walls
    starts = place.grid.starts
    items = place.grid.items
    shape = place.grid.shape[0]
    pose = poses[0]
    c = math.cos(pose.theta)
    s = math.sin(pose.theta)
    total = 0.0
    for i in range(len(scan)):
        if matches[i].wall >= 0:
            continue
        x = c * scan[i].x - s * scan[i].y + pose.x
        y = s * scan[i].x + c * scan[i].y + pose.y
        dx = c * scan[i].dx - s * scan[i].dy
        dy = s * scan[i].dx + c * scan[i].dy
        fx = (x - shape.x0) / shape.cell
        fy = (y - shape.y0) / shape.cell
        if not (fx >= 0.0 and fy >= 0.0 and fx < shape.columns and fy < shape.rows):
            continue
        here = int(fy) * shape.columns + int(fx)
        for k in range(starts[here], starts[here + 1]):
            wall = walls[items[k]]
            along = wall.dx * x + wall.dy * y
            if along < wall.begin or along > wall.end or abs(wall.dx * dy - wall.dy * dx) > PARALLEL_SINE:
                continue
            if NEAR < abs(wall.dx * y - wall.dy * x - wall.offset) <= REACH:
                total += scan[i].length
                break
    return total
