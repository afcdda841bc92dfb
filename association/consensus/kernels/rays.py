"""Cast rays: for each beam at each pose the first wall that it meets, and walls that beams pass through."""

from __future__ import annotations

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Records

from ...layout import Indices
from ...scan.kernels.joining import ascending
from ...tables import Place
from ..tuning import SIGHT_TOLERANCE


@kernel
def cast_beams(beams: Records, reach: float, behind: float, poses: Records, place: Place, table: Records) -> None:
    """Write what the map shows each beam at each pose, (k, m) of `SHOWN`.

    Parameters
    ----------
    beams : (m,) of `BEAM`
        In the scan frame.
    reach : float
        Distance up to which a beam is followed, metres; and up to
    behind : float
        metres behind its reading.
    poses : (k,) with the fields of `POSE`
        In the index frame.
    place : Place
        Walls, or obstacles.
    table : (k, m) of `SHOWN`
        Written: the distance to the first wall, the wall or -1, and the cosine of incidence there.
    """
    walls = place.walls
    starts = place.grid.starts
    items = place.grid.items
    shape = place.grid.shape[0]
    cell = shape.cell
    columns = shape.columns
    rows = shape.rows
    for p in range(len(poses)):
        c = math.cos(poses[p].theta)
        s = math.sin(poses[p].theta)
        for b in range(len(beams)):
            out = table[p, b]
            beam = beams[b]
            x = c * beam.x - s * beam.y + poses[p].x
            y = s * beam.x + c * beam.y + poses[p].y
            dx = c * beam.dx - s * beam.dy
            dy = s * beam.dx + c * beam.dy
            limit = min(reach, beam.range + behind)
            out.distance = limit
            out.wall = -1
            out.incidence = 0.0
            fx = (x - shape.x0) / cell
            fy = (y - shape.y0) / cell
            at = 0.0
            outside = False
            for k in range(2):  # enter the grid from outside
                f = fx if k == 0 else fy
                d = dx if k == 0 else dy
                size = float(columns) if k == 0 else float(rows)
                if f < 0.0 or f >= size:
                    edge = -f if f < 0.0 else size - f
                    if edge * d <= 0.0:
                        outside = True
                    else:
                        at = max(at, edge / d * cell)
            if outside:
                continue
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
            while at < best and 0 <= column < columns and 0 <= row < rows:
                here = row * columns + column
                for k in range(starts[here], starts[here + 1]):
                    wall = walls[items[k]]
                    across = wall.dx * dy - wall.dy * dx
                    if abs(across) > 1e-9:
                        distance = (wall.offset - wall.dx * y + wall.dy * x) / across
                        if distance > 1e-6 and distance < best:
                            along = wall.dx * (x + distance * dx) + wall.dy * (y + distance * dy)
                            if along >= wall.begin and along <= wall.end:
                                best = distance
                                out.wall = items[k]
                                out.incidence = abs(across)
                at = min(next_x, next_y)
                if next_x < next_y:
                    column += step_x
                    next_x += pace_x
                else:
                    row += step_y
                    next_y += pace_y
            out.distance = best


@kernel
def passed_walls(
    beams: Records, line: Indices, sensor: Indices, table: Records, matches: Records
) -> tuple[Indices, Indices, Floats, Floats]:
    """Return the walls that rays to lines pass through well before their end, and how many rays do.

    Parameters
    ----------
    beams : (m,) of `BEAM`
    line, sensor : (m,)
        The scan line that each goes to, and its view.
    table : (k, m) of `SHOWN`
    matches : (k, n) of `MATCH`

    Returns
    -------
    poses, walls : (p,)
    to_matched, to_clutter : (p,) float64
        Rays to matched lines and to others, at most from any one view.
    """
    m = len(beams)
    sensors = 1
    for b in range(m):
        sensors = max(sensors, sensor[b] + 1)
    room = 0
    for p in range(len(table)):
        for b in range(m):
            room += table[p, b].wall >= 0 and beams[b].range - SIGHT_TOLERANCE > table[p, b].distance
    poses, walls = np.empty(room, np.intp), np.empty(room, np.intp)
    to_matched, to_clutter = np.zeros(room), np.zeros(room)
    keys, passing = np.empty(m), np.empty(m, np.intp)
    found = 0
    for p in range(len(table)):
        count = 0
        for b in range(m):
            one = table[p, b]
            if one.wall >= 0 and line[b] >= 0 and beams[b].range - SIGHT_TOLERANCE > one.distance:
                keys[count] = one.wall * sensors + sensor[b]
                passing[count] = b
                count += 1
        order = ascending(keys[:count])
        before = -1
        last = -1.0
        matched = 0.0
        clutter = 0.0
        for place in range(count):
            b = passing[order[place]]
            wall = table[p, b].wall
            if wall != before:
                poses[found], walls[found] = p, wall
                found += 1
                before = wall
            if keys[order[place]] != last:
                matched = clutter = 0.0
                last = keys[order[place]]
            if matches[p, line[b]].wall >= 0:
                matched += 1.0
            else:
                clutter += 1.0
            to_matched[found - 1] = max(to_matched[found - 1], matched)
            to_clutter[found - 1] = max(to_clutter[found - 1], clutter)
    return poses[:found], walls[:found], to_matched[:found], to_clutter[:found]
