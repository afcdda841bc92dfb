"""The sums of a consensus set, which change in constant time when a pair comes or goes.

The score of a set follows from these sums: the chi-square and the information of its pose. The pairs of each wall are
also summed by wall, because they share the wall's own error: see `wall_errors`.
"""

from compiled import kernel
from registration.kernels import joint_add
from registration.layout import Record, Records

from ...tables import Workspace
from ..tuning import SAME_SHIFT
from .reliability import add_angle, clear_angles


@kernel
def clear_sums(sums: Record) -> None:
    """Set the sums to those of no pair."""
    sums.cc = 0.0
    sums.cs = 0.0
    sums.cx = 0.0
    sums.cy = 0.0
    sums.c1 = 0.0
    sums.ss = 0.0
    sums.sx = 0.0
    sums.sy = 0.0
    sums.s1 = 0.0
    sums.xx = 0.0
    sums.xy = 0.0
    sums.x1 = 0.0
    sums.yy = 0.0
    sums.y1 = 0.0
    sums.one = 0.0
    sums.wahba_cos = 0.0
    sums.wahba_sin = 0.0
    sums.count = 0.0


@kernel
def copy_sums(one: Record, other: Record) -> None:
    """Write the first sums to the second."""
    other.cc = one.cc
    other.cs = one.cs
    other.cx = one.cx
    other.cy = one.cy
    other.c1 = one.c1
    other.ss = one.ss
    other.sx = one.sx
    other.sy = one.sy
    other.s1 = one.s1
    other.xx = one.xx
    other.xy = one.xy
    other.x1 = one.x1
    other.yy = one.yy
    other.y1 = one.y1
    other.one = one.one
    other.wahba_cos = one.wahba_cos
    other.wahba_sin = one.wahba_sin
    other.count = one.count


@kernel
def clear_wall(own_sums: Record) -> None:
    """Set a wall's sums to those of no pair."""
    own_sums.c = 0.0
    own_sums.s = 0.0
    own_sums.x = 0.0
    own_sums.y = 0.0
    own_sums.one = 0.0
    own_sums.weight = 0.0
    own_sums.count = 0.0


@kernel
def update_pair(work: Workspace, wall: Record, seen: Record, i: int, w: int, sign: float) -> None:
    """Add (`sign` 1) or remove (-1) the pair of scan line i, `seen`, on wall w that is held; in constant time."""
    scratch = work.scratch[0]
    line = scratch.line
    line.dx = wall.dx
    line.dy = wall.dy
    line.offset = wall.offset + work.shifts_held[i]
    weight = work.weights_held[i]
    joint_add(scratch.plain, line, seen, weight, sign)
    add_angle(scratch.angles, line, sign * weight * seen.spread)
    own_sums = work.wall_sums[w]
    own_sums.count += sign
    if own_sums.count <= 0.0:
        clear_wall(own_sums)
        return
    weight *= sign
    own_sums.c += weight * (line.dx * seen.centroid_y - line.dy * seen.centroid_x)
    own_sums.s += weight * (line.dx * seen.centroid_x + line.dy * seen.centroid_y)
    own_sums.x -= weight * line.dy
    own_sums.y += weight * line.dx
    own_sums.one -= weight * line.offset
    own_sums.weight += weight


@kernel
def update_pairs(scan: Records, matches: Records, walls: Records, work: Workspace) -> bool:
    """Change the sums of `work` from the pairs that they hold to those of `matches`; return whether any changed."""
    held = work.held
    shifts = work.shifts_held
    weights = work.weights_held
    changed = False
    for i in range(len(scan)):
        w = matches[i].wall
        h = held[i]
        if w != h or (w >= 0 and abs(matches[i].shift - shifts[i]) > SAME_SHIFT):
            changed = True
            if h >= 0:
                update_pair(work, walls[h], scan[i], i, h, -1.0)
            held[i] = w
            if w >= 0:
                shifts[i] = matches[i].shift
                weights[i] = scan[i].weight
                update_pair(work, walls[w], scan[i], i, w, 1.0)
    return changed


@kernel
def empty_sums(work: Workspace) -> None:
    """Empty the sums of `work` and those of its walls."""
    held = work.held
    wall_sums = work.wall_sums
    clear_sums(work.scratch[0].plain)
    clear_angles(work.scratch[0].angles)
    for i in range(len(held)):
        if held[i] >= 0:
            clear_wall(wall_sums[held[i]])
            held[i] = -1
