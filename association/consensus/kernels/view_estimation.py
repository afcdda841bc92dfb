"""Sum the evidence of walls by several views, by view and by wall."""

import math

from compiled import kernel
from registration.layout import Floats, Records

from ...tables import SeenByViews
from ..tuning import ROUGH_FRACTION


@kernel
def add_views(
    by_views: SeenByViews,
    shifts: Floats,
    poses: Records,
    wall_variance: float,
    own: Floats,
    wall_sums: Floats,
    wall_sums_of_views: Floats,
    weights: Floats,
) -> None:
    """Add up offsets and angles from the walls, with their derivatives.

    Parameters
    ----------
    by_views : SeenByViews
    shifts : (v, 3)
        Corrections of the views' reported poses: x, y, theta in the scan frame.
    poses : (1,) of `POSE`
        Index frame from scan frame.
    wall_variance : float
        Of the walls' own offsets, m^2.
    own : (v, 7, 7)
        Of each view, the weighted products of offsets' and angles' derivatives by the pose, by the view's own pose, and
        of the residual, in this order. Added to.
    wall_sums : (w, 4)
        Of each wall, weighted derivatives of offsets by the pose, and the weighted residual. Added to.
    wall_sums_of_views : (w, 3 v)
        The same by the pose of each view. Added to.
    weights : (w,)
        The weights. Added to.
    """
    seen, walls, number, origins = by_views.seen, by_views.walls, by_views.number, by_views.origins
    pose = poses[0]
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    for k in range(len(seen)):
        line, wall, at, on = seen[k], walls[k], seen[k].sensor, number[k]
        turn = shifts[at, 2]
        tc, ts = math.cos(turn), math.sin(turn)
        reach_x, reach_y = line.centroid_x - origins[at].x, line.centroid_y - origins[at].y
        lever_x, lever_y = tc * reach_x - ts * reach_y, ts * reach_x + tc * reach_y
        place_x, place_y = origins[at].x + shifts[at, 0] + lever_x, origins[at].y + shifts[at, 1] + lever_y
        there_x, there_y = c * place_x - s * place_y, s * place_x + c * place_y
        nx, ny = -wall.dy, wall.dx
        own_nx, own_ny = c * nx + s * ny, c * ny - s * nx  # the normal in the scan frame
        offset = nx * (there_x + pose.x) + ny * (there_y + pose.y) - wall.offset
        by_turn, by_own_turn = ny * there_x - nx * there_y, own_ny * lever_x - own_nx * lever_y
        to_c, to_s = math.cos(turn + pose.theta), math.sin(turn + pose.theta)
        to_x, to_y = to_c * line.dx - to_s * line.dy, to_s * line.dx + to_c * line.dy
        sine, cosine = wall.dx * to_y - wall.dy * to_x, wall.dx * to_x + wall.dy * to_y
        weight = 1.0 / (line.variance + ROUGH_FRACTION * wall_variance)
        row = (nx, ny, by_turn, own_nx, own_ny, by_own_turn, offset)
        sums = own[at]
        for i in range(7):
            for j in range(7):
                sums[i, j] += weight * row[i] * row[j]
        angular = weight * line.spread
        for i in (2, 5):
            for j in (2, 5):
                sums[i, j] += angular * cosine * cosine
            sums[i, 6] += angular * cosine * sine
            sums[6, i] += angular * cosine * sine
        sums[6, 6] += angular * sine * sine
        for i in range(3):
            wall_sums[on, i] += weight * row[i]
            wall_sums_of_views[on, 3 * at + i] += weight * row[3 + i]
        wall_sums[on, 3] += weight * offset
        weights[on] += weight
