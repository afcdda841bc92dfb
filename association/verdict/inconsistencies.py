"""Inconsistencies of scan and map at a pose: things that beams miss, displaced walls, distorted angles."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from registration.layout import Floats

from ..consensus.beams import rays_of
from ..consensus.consensus_set import ConsensusSet
from ..consensus.tuning import MOST_BEAMS
from ..context import SearchContext
from ..index.tuning import MERGE_GAP
from ..tables import Rays
from ..tuning import MODEL_ANGLE
from .kernels.absences import limit_by_things, read_beams
from .kernels.displaced_walls import displaced_length
from .tuning import ABSENCE, FEWEST_FOR_TURN, MANY, TURN_DEVIATIONS


def absences(context: SearchContext, best: ConsensusSet, others: Sequence[ConsensusSet]) -> Floats:
    """Return the most that beams may count against each alternative, (k,) nats; 0 without beams or time.

    Beams that speak against an alternative more than against the answer belong to one thing where their ends are near
    one another, as pieces of one wall are. Each thing counts `ABSENCE` at most.
    """
    if not len(others) or not context.with_beams or not context.can_look or context.deadline.passed:
        return np.zeros(len(others))
    rays = rays_of(context, MOST_BEAMS)
    here = readings_of(context, rays, best)
    return np.array(
        [limit_by_things(rays, here, readings_of(context, rays, one), MERGE_GAP, ABSENCE) for one in others]
    )


def readings_of(context: SearchContext, rays: Rays, one: ConsensusSet, wider: float = 1.0) -> Floats:
    """Return for each beam what `read_beams` writes of it at a pose, (n, 2), with tolerances `wider` times as wide."""
    readings = np.zeros((len(rays.beams), 2))
    index = context.index
    read_beams(rays, one.estimate, index.tables.place, index.obstacles, context.workspace, wider, readings)
    return readings


def displaced_walls(context: SearchContext, best: ConsensusSet) -> float:
    """Return the fraction of the scan's length that is parallel to a wall at 0.1 to 0.35 m from it; 0 to 1.

    On a map that is distorted, or that shows the middle of walls for their faces, a pose may fit some walls to
    millimetres and miss all others by decimetres. The covariance does not contain that error.

    0 where the views of a drive are not exact: their walls are off by the errors of the steps between them. Likewise
    where too many walls lie in one place.
    """
    views = context.scan.views
    if context.too_late_to_look or (views is not None and views.uncertain):
        return 0.0
    scan = context.lines.rows
    length = displaced_length(scan, best.matches, best.estimate, context.index.tables.place)
    return float(length / np.sum(scan["length"]))


def turn_during_scan(context: SearchContext, best: ConsensusSet) -> float:
    """Return by how much the robot seems to have turned from the first beam to the last, rad, 0 or more.

    A turn at a constant rate turns each line of the scan in proportion to the time of its beams, and so to their
    bearing; a wrong angle between two beams does the same. Weighted least squares fits the rate and the heading to the
    angles between the matched lines and their walls. The residuals give the deviation; of few lines it is not below
    that of the lines' angles.

    0 if the rate is within `TURN_DEVIATIONS` deviations of 0; if the turn is below `MODEL_ANGLE`, as rounding makes of
    scans without noise; without ranges or their order, of several views, and of few lines.
    """
    scan = context.scan
    if scan.beams is None or scan.views is not None or not scan.ordered or len(scan.beams.angles) < 2:
        return 0.0
    matched = best.matched
    lines, walls = context.lines.rows[matched], context.index.walls.rows[best.matches["wall"][matched]]
    if len(lines) < FEWEST_FOR_TURN:
        return 0.0
    x, y = scan.viewpoint or (0.0, 0.0)
    first, last = float(scan.beams.angles[0]), float(scan.beams.angles[-1])
    way = math.copysign(1.0, last - first)
    bearings = way * (np.arctan2(lines["y"] - y, lines["x"] - x) - first) % math.tau
    off = walls["angle"] - lines["angle"] - best.pose.theta
    off = off - math.tau * np.round(off / math.tau)
    weights = 1.0 / lines["angle_variance"]
    mean, mean_off = np.average(bearings, weights=weights), np.average(off, weights=weights)
    information = float(weights @ (bearings - mean) ** 2)
    if not information > 0.0:
        return 0.0
    rate = float(weights @ ((bearings - mean) * (off - mean_off))) / information
    left = off - mean_off - rate * (bearings - mean)
    scale = float(weights @ left**2) / (len(lines) - 2)
    if len(lines) < MANY:
        scale = max(1.0, scale)
    turn = abs(rate * (last - first))
    return turn if turn > MODEL_ANGLE and abs(rate) > TURN_DEVIATIONS * math.sqrt(scale / information) else 0.0
