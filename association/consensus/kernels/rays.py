"""Cast rays: for each beam at each pose the first wall that it meets."""

from __future__ import annotations

import math

from compiled import kernel
from registration.kernels import joint_add, joint_solve
from registration.layout import Floats, Records

from ...tables import Place
from ..tuning import LEAST_POINTS, NEAR, SPRING
from .pairs import copy_sums


@kernel
def cast_beams(beams: Records, reach: float, behind: float, poses: Records, place: Place, table: Records) -> None:
    """Write what the map shows each beam at each pose, (k, m) of `SHOWN`.

    Parameters
    ----------
    beams : (m,) of `BEAM`
        In the scan frame.
    reach : float
        How far a beam is followed, metres; and up to
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
def move_to_beams(beams: Records, poses: Records, place: Place, gates: Floats, scratch: Records) -> None:
    """Move poses to where the ends of the beams lie on the walls nearest to them, within each of the gates, metres.

    Parameters
    ----------
    beams : (m,) of `BEAM`
    poses : (k,) of `ESTIMATE`
        Changed, their covariances not.
    place : Place
    gates : (r,)
        Of the rounds.
    scratch : (1,) of `BEAM_SCRATCH`
    """
    walls = place.walls
    starts = place.grid.starts
    items = place.grid.items
    shape = place.grid.shape[0]
    sums = scratch[0].sums
    point = scratch[0].point
    line = scratch[0].line
    nothing = scratch[0].nothing
    for p in range(len(poses)):
        pose = poses[p]
        for r in range(len(gates)):
            copy_sums(nothing, sums)
            c = math.cos(pose.theta)
            s = math.sin(pose.theta)
            for b in range(len(beams)):
                if math.isinf(beams[b].range):
                    continue
                px = beams[b].x + beams[b].range * beams[b].dx
                py = beams[b].y + beams[b].range * beams[b].dy
                x = c * px - s * py + pose.x
                y = s * px + c * py + pose.y
                fx = (x - shape.x0) / shape.cell
                fy = (y - shape.y0) / shape.cell
                if not (fx >= 0.0 and fy >= 0.0 and fx < shape.columns and fy < shape.rows):
                    continue
                here = int(fy) * shape.columns + int(fx)
                nearest = -1
                least = gates[r]
                for k in range(starts[here], starts[here + 1]):
                    wall = walls[items[k]]
                    along = wall.dx * x + wall.dy * y
                    off = abs(wall.dx * y - wall.dy * x - wall.offset)
                    if off < least and wall.begin - NEAR <= along <= wall.end + NEAR:
                        least = off
                        nearest = items[k]
                if nearest >= 0:
                    point.centroid_x = px
                    point.centroid_y = py
                    line.dx = walls[nearest].dx
                    line.dy = walls[nearest].dy
                    line.offset = walls[nearest].offset
                    joint_add(sums, line, point, 1.0, 1.0)
            if sums.count < LEAST_POINTS:
                break
            sums.xx += SPRING
            sums.yy += SPRING
            sums.x1 -= SPRING * pose.x
            sums.y1 -= SPRING * pose.y
            theta, x, y, _, _ = joint_solve(sums, pose.theta, False)
            pose.theta = theta
            pose.x = x
            pose.y = y
