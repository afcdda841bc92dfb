"""Match the lines of a scan to walls at a pose."""

from __future__ import annotations

import math

from compiled import kernel
from registration.layout import Record, Records

from ...layout import MOST_NOTED
from ...tables import Place
from ...tuning import DIRECTION_BINS
from ..tuning import MOST_BRIDGED
from .pairs import begin_cover, begin_way, end_way, follow, misfit_of, put_line, write_match

BINS_PER_RADIAN = DIRECTION_BINS / (2.0 * math.pi)
GATE_MARGIN = 1.01  # over a gate: angles are tested by a cosine to the second order
SUM_SLACK = 1e-9  # nats, rounding


@kernel
def match_lines(
    scan: Records, gates: Record, place: Place, pose: Record, found: Records, threshold: float, scratch: Record
) -> float:
    """Match every scan line to the wall that it lies on best, and return what all gain, nats.

    The most informative lines come first; where what is left cannot reach the threshold, -1 is returned, and the other
    lines are not matched. Nor are those that are known to lie on no wall.
    """
    walls, bin_starts = place.walls, place.bin_starts
    starts, items, shape = place.grid.starts, place.grid.items, place.grid.shape[0]
    line, cover = scratch.line, scratch.cover
    c = math.cos(pose.theta)
    s = math.sin(pose.theta)
    per_cell = 1.0 / shape.cell
    gain = 0.0
    left = SUM_SLACK
    for i in range(len(scan)):
        left += 0.0 if is_unfit(pose, i) else scan[i].gain
    for i in range(len(scan)):
        match = found[i]
        match.wall = -1
        match.overlap = 0.0
        match.gain = 0.0
        if is_unfit(pose, i):
            continue
        left -= scan[i].gain
        fx = (c * scan[i].x - s * scan[i].y + pose.x - shape.x0) * per_cell
        fy = (s * scan[i].x + c * scan[i].y + pose.y - shape.y0) * per_cell
        if fx >= 0.0 and fy >= 0.0 and fx < shape.columns and fy < shape.rows:
            cell = int(fy) * shape.columns + int(fx)
            if starts[cell] < starts[cell + 1]:
                put_line(scan[i], pose, c, s, gates, line)
                turned = (pose.theta + scan[i].angle + math.pi) * BINS_PER_RADIAN
                spread = GATE_MARGIN * line.angle_gate * BINS_PER_RADIAN
                lowest = math.floor(turned - spread) % DIRECTION_BINS
                highest = math.floor(turned + spread) % DIRECTION_BINS
                low_wall, high_wall = bin_starts[lowest], bin_starts[highest + 1]
                least_misfit = 1e300
                to_follow = MOST_BRIDGED
                for item in range(starts[cell], starts[cell + 1]):
                    w = items[item]
                    if lowest <= highest:
                        if w < low_wall or w >= high_wall:
                            continue
                    elif high_wall <= w < low_wall:
                        continue
                    wall = walls[w]
                    if not begin_cover(wall, line, cover):
                        continue
                    for side in range(2):
                        way = 1.0 - 2.0 * side
                        v = wall.after if side == 0 else wall.before
                        short = cover.high < line.half if side == 0 else cover.low > -line.half
                        if v < 0 or not short:
                            continue
                        begin_way(cover, way)
                        while v >= 0 and cover.way.reach < line.half and to_follow > 0:
                            to_follow -= 1
                            if not follow(walls[v], wall, line, way, cover):
                                break
                            v = walls[v].after if side == 0 else walls[v].before
                        end_way(cover)
                    if cover.counted >= gates.least_overlap * 2.0 * line.half:
                        misfit = misfit_of(line, cover)
                        if misfit < least_misfit:
                            least_misfit = misfit
                            match.wall = w
                            write_match(match, scan[i], line, wall, cover, gates.least_overlap)
        gain += match.gain
        if gain + left < threshold:
            return -1.0
    return gain


@kernel
def is_unfit(pose: Record, line: int) -> bool:
    """Return whether a scan line is known to lie on no wall at a pose."""
    return line < MOST_NOTED and (pose.unfit >> line) & 1 == 1
