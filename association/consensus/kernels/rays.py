"""Cast rays: for each beam at each pose the first wall that it meets."""

from __future__ import annotations

import math

from compiled import kernel
from registration.layout import Records

from ...tables import Place


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
