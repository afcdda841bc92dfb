"""Follow lines of sight: which wall a ray from a pose meets first, and which rays pass through walls."""

import math

from compiled import kernel
from registration.layout import Record, Records

from ...layout import Integers
from ...tables import Blockers, Place, Sights
from ...tuning import MAX_RAYS, RAY_SPACING
from ..tuning import BLOCKED, BLOCKING_LENGTH, BLOCKING_RAYS, END_MARGIN, SIGHT_TOLERANCE


@kernel
def first_hit(ray: Record, walls: Records, starts: Integers, items: Integers, shape: Record) -> tuple[float, int]:
    """Return the distance to the first wall along a ray and that wall, ``(limit, -1)`` when there is none before.

    Takes the arrays of a `Place` one by one: it is called for each ray, and takes no time to count references.
    """
    x = ray.x
    y = ray.y
    dx = ray.dx
    dy = ray.dy
    limit = ray.limit
    cell = shape.cell
    columns = shape.columns
    rows = shape.rows
    fx = (x - shape.x0) / cell
    fy = (y - shape.y0) / cell
    at = 0.0
    # Enter the grid from outside.
    for k in range(2):
        p = fx if k == 0 else fy
        d = dx if k == 0 else dy
        size = float(columns) if k == 0 else float(rows)
        if p < 0.0 or p >= size:
            edge = -p if p < 0.0 else size - p
            if edge * d <= 0.0:
                return limit, -1
            at = max(at, edge / d * cell)
    at += 1e-9 if at > 0.0 else 0.0
    column = math.floor(fx + at / cell * dx)
    row = math.floor(fy + at / cell * dy)
    step_x = 1 if dx > 0.0 else -1
    step_y = 1 if dy > 0.0 else -1
    pace_x = cell / max(abs(dx), 1e-12)
    pace_y = cell / max(abs(dy), 1e-12)
    next_x = ((column + 1 - fx) if dx > 0.0 else (fx - column)) * pace_x
    next_y = ((row + 1 - fy) if dy > 0.0 else (fy - row)) * pace_y
    best = limit
    wall = -1
    while at < best and 0 <= column < columns and 0 <= row < rows:
        here = row * columns + column
        for k in range(starts[here], starts[here + 1]):
            w = items[k]
            wx = walls[w].dx
            wy = walls[w].dy
            across = wx * dy - wy * dx
            if abs(across) > 1e-9:
                reach = (walls[w].offset - wx * y + wy * x) / across
                if reach > 1e-6 and reach < best:
                    along = wx * (x + reach * dx) + wy * (y + reach * dy)
                    if along >= walls[w].begin and along <= walls[w].end:
                        best = reach
                        wall = w
        at = min(next_x, next_y)
        if next_x < next_y:
            column += step_x
            next_x += pace_x
        else:
            row += step_y
            next_y += pace_y
    return best, wall


@kernel
def count_blockers(
    sights: Sights, matches: Records, pose: Record, place: Place, blockers: Blockers, ray: Record
) -> int:
    """Count for every wall the rays to segments, from where each was seen, that pass through it well before their end.

    Of the rays that several views send to one line of the scan those of the view count that has most of them.
    `matches` by row of the scan. `blockers` counts nothing before. Returns how many walls that are, listed in
    ``blockers.touched``.
    """
    walls = place.walls
    places = sights.places
    starts = place.grid.starts
    items = place.grid.items
    shape = place.grid.shape[0]
    counts = blockers.counts
    touched = blockers.touched
    count = 0
    c = math.cos(pose.theta)
    s = math.sin(pose.theta)
    seen = sights.seen
    for i in sights.by_line:
        view = places[seen[i].sensor]
        x = c * view.x - s * view.y + pose.x
        y = s * view.x + c * view.y + pose.y
        ray.x = x
        ray.y = y
        length = seen[i].length
        rays = min(MAX_RAYS, max(1, math.ceil(length / RAY_SPACING)))
        usable = max(0.0, length - 2.0 * END_MARGIN)
        for k in range(rays):
            along = ((k + 0.5) / rays - 0.5) * usable
            px = seen[i].x + along * seen[i].dx
            py = seen[i].y + along * seen[i].dy
            gx = c * px - s * py + pose.x - x
            gy = s * px + c * py + pose.y - y
            distance = math.sqrt(gx * gx + gy * gy)
            limit = distance - SIGHT_TOLERANCE
            if limit > 0.0:
                ray.dx = gx / distance
                ray.dy = gy / distance
                ray.limit = limit
                _, w = first_hit(ray, walls, starts, items, shape)
                if w >= 0:
                    if counts[w].to_matched + counts[w].to_clutter == 0:
                        touched[count] = w
                        count += 1
                    if is_another(counts[w], seen[i]):
                        count_ray(counts[w], matches[seen[i].row])
    return count


@kernel
def count_ray(blocker: Record, match: Record) -> None:
    """Count a ray through a wall, to a line with this match."""
    if match.wall >= 0:
        blocker.to_matched += 1
    else:
        blocker.to_clutter += 1


@kernel
def is_another(blocker: Record, sighting: Record) -> bool:
    """Count a ray through a wall; return whether no view before sent as many through it to that line of the scan."""
    if blocker.row != sighting.row + 1:
        blocker.row = sighting.row + 1
        blocker.most = 0
        blocker.here = 0
    elif blocker.sensor != sighting.sensor:
        blocker.here = 0
    blocker.sensor = sighting.sensor
    blocker.here += 1
    if blocker.here <= blocker.most:
        return False
    blocker.most = blocker.here
    return True


@kernel
def sight_penalty(blockers: Blockers, count: int, walls: Records) -> float:
    """Return the penalty for walls that should have blocked the view, nats, at least 0; clear the counts.

    A wall counts once, however many rays pass, and by its length: short ones on a map made by a robot are often people
    and carts that have gone since. Rays to clutter prove less than rays to the consensus set. Yet many walls between
    the sensor and the observed segments are unlikely at the right pose.
    """
    counts = blockers.counts
    total = 0.0
    for k in range(count):
        w = blockers.touched[k]
        length = min(BLOCKING_LENGTH, walls[w].end - walls[w].begin)
        total += BLOCKED * length * min(1.0, counts[w].to_matched / BLOCKING_RAYS)
        total += BLOCKED * length * min(1.0, counts[w].to_clutter / BLOCKING_RAYS)
        counts[w].to_matched = 0
        counts[w].to_clutter = 0
        counts[w].row = 0
    return total
