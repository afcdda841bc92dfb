"""Arithmetic on the records of one pair: how a scan line lies on a wall, and what the pair adds to the sums."""

from __future__ import annotations

import math

from compiled import kernel
from registration.kernels import invert3, joint_add, joint_cost, joint_information, joint_solve
from registration.layout import Record

from ...index.kernels.walls import fade
from ...tuning import APART_GAP, APART_STEP, WHOLE_GAP
from ..tuning import (
    FLAT_GATE,
    FLAT_STEP,
    FREE_DEVIATION,
    LONG_BRIDGE,
    MAX_STEP,
    MAX_TURN,
    OVERLAP_TAPER,
    SHORT_BRIDGE,
    SPRING,
)
from .geometry import angle_gate, wrap


@kernel
def put_line(seen: Record, pose: Record, c: float, s: float, gates: Record, line: Record) -> None:
    """Write a scan line at a pose of cosine `c` and sine `s`, with its gates, to `line`, a record of `POSED_LINE`."""
    x, y = c * seen.x - s * seen.y, s * seen.x + c * seen.y
    dx, dy = c * seen.dx - s * seen.dy, s * seen.dx + c * seen.dy
    lever = dx * x + dy * y
    variance = (
        dy * dy * pose.xx
        - 2.0 * dx * dy * pose.xy
        + dx * dx * pose.yy
        + 2.0 * lever * (dx * pose.yt - dy * pose.xt)
        + lever * lever * pose.tt
    )
    deviation = math.sqrt(seen.offset_variance + max(variance, 0.0))
    line.x, line.y, line.dx, line.dy = x + pose.x, y + pose.y, dx, dy
    line.half = 0.5 * seen.length
    line.gate = min(gates.greatest_offset, max(gates.least_offset, gates.sigmas * deviation))
    line.angle_gate = angle_gate(seen, pose.tt, gates)
    line.least_cosine = 1.0 - 0.5 * line.angle_gate * line.angle_gate


@kernel
def begin_cover(wall: Record, line: Record, cover: Record) -> bool:
    """Write what a wall covers of a posed line to `cover`, of `COVER`; return False where it covers nothing."""
    cover.offset = wall.dx * line.y - wall.dy * line.x - wall.offset
    if abs(cover.offset) > line.gate or wall.dx * line.dx + wall.dy * line.dy < line.least_cosine:
        return False
    along = wall.dx * line.x + wall.dy * line.y
    cover.low = max(wall.begin - along, -line.half)
    cover.high = min(wall.end - along, line.half)
    cover.counted = cover.high - cover.low
    cover.covered = cover.counted
    cover.first = 0.0
    cover.second = 0.0
    return cover.covered > 0.0


@kernel
def begin_way(cover: Record, way: float) -> None:
    """Start to follow the walls that continue a wall in one direction: 1 forwards, -1 backwards."""
    cover.way = cover.none
    cover.best = cover.none
    cover.way.reach = cover.high if way > 0.0 else -cover.low
    cover.way.weight = 1.0


@kernel
def follow(wall: Record, base: Record, line: Record, way: float, cover: Record) -> bool:
    """Add what the next wall that continues `base` covers of a line; return False where it begins beyond the line.

    A gap up to `WHOLE_GAP` is as good as covered; a wider one counts against the cover, and what lies behind it less.
    """
    sums = cover.way
    along = wall.dx * line.x + wall.dy * line.y
    begin = wall.begin - along if way > 0.0 else along - wall.end
    end = wall.end - along if way > 0.0 else along - wall.begin
    if begin >= line.half:
        return False
    if begin > sums.reach:
        gap = begin - sums.reach
        whole = fade(gap, WHOLE_GAP, APART_GAP)
        bridges = min(1.0, max(0.0, (2.0 * line.half - SHORT_BRIDGE) / (LONG_BRIDGE - SHORT_BRIDGE)))
        sums.weight *= whole + (1.0 - whole) * bridges
        sums.net += sums.weight * gap * (2.0 * whole - 1.0)
    start = max(begin, sums.reach)
    stop = min(end, line.half)
    if stop > start:
        middle = way * 0.5 * (start + stop)
        x, y = line.x + middle * line.dx, line.y + middle * line.dy
        off = wall.dx * y - wall.dy * x - wall.offset
        beside = base.dx * y - base.dy * x - base.offset - off
        part = sums.weight * (stop - start)
        part *= fade(abs(off), FLAT_GATE * line.gate, line.gate) * fade(abs(beside), FLAT_STEP, APART_STEP)
        sums.net += part
        sums.covered += part
        sums.first += part * beside
        sums.second += part * beside * beside
        if sums.net > cover.best.net:
            cover.best = sums
        sums.reach = end
    return True


@kernel
def end_way(cover: Record) -> None:
    """Take over what the walls in one direction cover, as far as that is to the good."""
    cover.counted += cover.best.net
    cover.covered += cover.best.covered
    cover.first += cover.best.first
    cover.second += cover.best.second


@kernel
def misfit_of(line: Record, cover: Record) -> float:
    """Return the misfit of a line on a wall: its offset from what covers it, over the gate, and the missing overlap."""
    overlap = min(1.0, cover.counted / (2.0 * line.half))
    return abs(cover.offset - cover.first / cover.covered) / line.gate + 1.0 - overlap


@kernel
def write_match(match: Record, seen: Record, line: Record, wall: Record, cover: Record, least_overlap: float) -> None:
    """Write how a scan line lies on a wall, with its gain: by the overlap, and nothing at a gate.

    Steps between the walls under one straight line cost half of their chi-square.
    """
    shift = cover.first / cover.covered
    match.overlap = min(1.0, cover.counted / (2.0 * line.half))
    match.offset = cover.offset - shift
    match.shift = shift
    match.sine = line.dx * wall.dy - line.dy * wall.dx
    gain = seen.gain * match.overlap
    gain *= min(1.0, (match.overlap - least_overlap) / min(OVERLAP_TAPER, 1.0 - least_overlap))
    gain *= fade(abs(cover.offset), FLAT_GATE * line.gate, line.gate)
    gain *= fade(abs(match.sine), FLAT_GATE * line.angle_gate, line.angle_gate)
    uneven = max(0.0, cover.second / cover.covered - shift * shift)
    match.gain = max(0.0, gain - 0.5 * seen.weight * uneven)


@kernel
def change_pair(
    sums: Record, angles: Record, own: Record, wall: Record, seen: Record, held: Record, sign: float
) -> None:
    """Add (`sign` 1) or remove (-1) a pair, in constant time, from the sums, those of its angles and of its wall.

    `held` has the weight of the pair, and the shift of the line under the scan line from the wall's own. The sums of a
    wall without pairs are exactly 0.
    """
    line = held.line
    line.dx, line.dy, line.offset = wall.dx, wall.dy, wall.offset + held.shift
    joint_add(sums, line, seen, held.weight, sign)
    information = sign * held.weight * seen.spread
    angles.xx += information * line.dy * line.dy
    angles.xy -= information * line.dx * line.dy
    angles.yy += information * line.dx * line.dx
    own.count += sign
    weight = sign * held.weight
    own.c += weight * (line.dx * seen.centroid_y - line.dy * seen.centroid_x)
    own.s += weight * (line.dx * seen.centroid_x + line.dy * seen.centroid_y)
    own.x -= weight * line.dy
    own.y += weight * line.dx
    own.one -= weight * line.offset
    own.weight += weight
    if own.count <= 0.0:
        scale_wall(own, 0.0)


@kernel
def scale_wall(own: Record, factor: float) -> None:
    """Multiply the sums of a wall; with 0 they are those of no pair."""
    own.c *= factor
    own.s *= factor
    own.x *= factor
    own.y *= factor
    own.one *= factor
    own.weight *= factor


@kernel
def add_wall(common: Record, own: Record) -> None:
    """Add the sums of a wall to those of the walls before it that it is tied to."""
    common.c += own.c
    common.s += own.s
    common.x += own.x
    common.y += own.y
    common.one += own.one
    common.weight += own.weight


@kernel
def subtract_square(sums: Record, own: Record, k: float) -> None:
    """Take the square of a wall's sums, times k, out of the sums: the wall's own error is eliminated."""
    sums.cc -= k * own.c * own.c
    sums.cs -= k * own.c * own.s
    sums.cx -= k * own.c * own.x
    sums.cy -= k * own.c * own.y
    sums.c1 -= k * own.c * own.one
    sums.ss -= k * own.s * own.s
    sums.sx -= k * own.s * own.x
    sums.sy -= k * own.s * own.y
    sums.s1 -= k * own.s * own.one
    sums.xx -= k * own.x * own.x
    sums.xy -= k * own.x * own.y
    sums.x1 -= k * own.x * own.one
    sums.yy -= k * own.y * own.y
    sums.y1 -= k * own.y * own.one
    sums.one -= k * own.one * own.one


@kernel
def hold_sensor(sums: Record, x: float, y: float, at_x: float, at_y: float, weight: float) -> None:
    """Add a spring that holds the sensor, (x, y) in the scan frame, at a place of the map; or take it away."""
    square = weight * (x * x + y * y)
    sums.cc += square
    sums.ss += square
    sums.cx += weight * x
    sums.cy += weight * y
    sums.sx -= weight * y
    sums.sy += weight * x
    sums.c1 -= weight * (x * at_x + y * at_y)
    sums.s1 += weight * (y * at_x - x * at_y)
    sums.xx += weight
    sums.yy += weight
    sums.x1 -= weight * at_x
    sums.y1 -= weight * at_y
    sums.one += weight * (at_x * at_x + at_y * at_y)


@kernel
def solve_pose(sums: Record, angles: Record, parallel: float, model: Record, pose: Record, solution: Record) -> bool:
    """Move a pose to the least chi-square of the sums, and write its covariance; return False where that is far.

    `solution` gets the information and the chi-square. A weak spring holds the sensor along directions that no pair
    fixes. If the reliability of the set, Eq. (28) by the information of its angles, is what noise makes of parallel
    walls (`parallel`: their chi-square), the pose stays where it was along these walls.
    """
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    at_x = c * model.sensor_x - s * model.sensor_y + pose.x
    at_y = s * model.sensor_x + c * model.sensor_y + pose.y
    hold_sensor(sums, model.sensor_x, model.sensor_y, at_x, at_y, SPRING)
    theta, tx, ty, _, _ = joint_solve(sums, pose.theta)
    joint_information(sums, theta, solution)
    moved_x = math.cos(theta) * model.sensor_x - math.sin(theta) * model.sensor_y + tx - at_x
    moved_y = math.sin(theta) * model.sensor_x + math.cos(theta) * model.sensor_y + ty - at_y
    near = abs(wrap(theta - pose.theta)) <= MAX_TURN and moved_x**2 + moved_y**2 <= MAX_STEP**2
    regular = invert3(solution, pose)
    if near and regular:
        pose.theta = theta
        pose.x = tx
        pose.y = ty
    hold_sensor(sums, model.sensor_x, model.sensor_y, at_x, at_y, -SPRING)
    solution.chi_square = joint_cost(sums, pose.theta, pose.x, pose.y)
    if not regular:
        solution.chi_square = math.inf
        return False
    det = max(0.0, angles.xx * angles.yy - angles.xy * angles.xy)
    weight = angles.xx + angles.yy
    part = parallel / weight if weight > 0.0 else 1.0
    solution.parallel = part >= 0.5 or 4.0 * det <= 4.0 * part * (1.0 - part) * weight * weight
    if solution.parallel:
        across = 0.5 * math.atan2(2.0 * sums.xy, sums.xx - sums.yy)
        ux = -math.sin(across)
        uy = math.cos(across)
        shift = moved_x * ux + moved_y * uy if near else 0.0
        pose.x -= shift * ux
        pose.y -= shift * uy
        pose.xx += FREE_DEVIATION * FREE_DEVIATION * ux * ux
        pose.xy += FREE_DEVIATION * FREE_DEVIATION * ux * uy
        pose.yy += FREE_DEVIATION * FREE_DEVIATION * uy * uy
        solution.chi_square = joint_cost(sums, pose.theta, pose.x, pose.y)
    return near
