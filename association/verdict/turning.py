"""Evaluate whether the angles of a scan are distorted: by a turn of the robot, or a wrong angle between beams."""

from __future__ import annotations

import math

import numpy as np

from ..consensus.consensus_set import ConsensusSet
from ..context import SearchContext
from ..tuning import MODEL_ANGLE
from .tuning import FEWEST_FOR_TURN, MANY, TURN_DEVIATIONS


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
