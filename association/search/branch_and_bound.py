"""Search for poses by the points of beams: branch and bound over the likelihood field of the map.

Bases need two walls that are found in scan and map. If clutter hides walls, or if a map made by a robot has many short
pieces, there may be none at the truth. The ends of the beams alone then give the pose that bases miss.
"""

from __future__ import annotations

import math

import numpy as np

from registration.layout import Floats, Records
from registration.values import value

from ..consensus.beams import beam_evidence_at, rays_of
from ..consensus.tuning import LEAST_POINTS, MOST_BEAMS
from ..context import SearchContext
from ..deadline import CancelledError
from ..index.likelihood_field import LikelihoodField
from ..index.tuning import CELL_GROWTH
from ..layout import ESTIMATE, FOUND, Integers
from ..tuning import COMPARED_BEAMS, DISTINCT_ANGLE, DISTINCT_DISTANCE
from .candidates import Candidates
from .kernels.branch_and_bound import branch_and_bound, greatest_mean
from .layout import CELL_POSE
from .tuning import END_SQUARE, FIELD_GAP, FIELD_LEAST, FIELD_POINTS, KEPT, WELL_EXPLAINED

SQUARES_ACROSS = 1 << 32  # more than there are


@value(frozen=True, slots=True)
class _TurnedPoints:
    """The points of a scan at all headings.

    Attributes
    ----------
    headings : (h,) rad
    cells : (h, n, 2) int32
        Row and column of each point from the cell of the sensor.
    """

    headings: Floats
    cells: Integers


def add_point_matches(context: SearchContext, candidates: Candidates) -> Candidates:
    """Add the poses at which more of the beams end on walls than at any candidate.

    Returns the candidates as they are if there is none, if most beams end on walls at one of the candidates, without
    beams, with a hard prior, on a map that is too large for a likelihood field, and after the deadline. If the deadline
    passes meanwhile, the report is that of an incomplete search.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    points = _points_of(context)
    if len(points) < LEAST_POINTS:
        return candidates
    field = context.index.likelihood_field
    if field is None:
        return candidates
    reached = greatest_mean(field.pyramid[0], field.shape, points, candidates.poses)
    if reached >= WELL_EXPLAINED:
        return candidates
    cell = float(field.shape["cell"][0])
    turned = _at_all_headings(points, cell)
    found = np.zeros(KEPT, CELL_POSE)
    least, gap = (round(255.0 * len(points) * mean) for mean in (max(FIELD_LEAST, reached), FIELD_GAP))
    apart = math.ceil(DISTINCT_DISTANCE / cell), math.ceil(DISTINCT_ANGLE / math.tau * len(turned.headings))
    with context.deadline.watched() as stop:
        count = branch_and_bound(field.pyramid, turned.cells, least, gap, *apart, found, stop)
        interrupted = bool(stop[0])
    if context.deadline.cancelled:
        raise CancelledError
    report = candidates.report.cut_short() if interrupted else candidates.report
    if not count and not interrupted:
        return candidates
    poses = _poses_of(context, field, turned, found[:count])
    return Candidates(np.concatenate([candidates.poses, poses]), report)


def _points_of(context: SearchContext) -> Floats:
    """Return where the beams end, (n, 2) in the scan frame, metres; none where there is nothing to search.

    One of each square, so that near walls count no more, in an order that is not that of the beams: a bound is then
    exceeded sooner.
    """
    usable = context.with_beams and context.window is None and len(context.lines.rows) > 0
    if not usable or not context.can_look or context.deadline.passed:
        return np.zeros((0, 2))
    beams = rays_of(context, COMPARED_BEAMS).beams
    beams = beams[np.isfinite(beams["range"])]
    ends = np.stack([beams[at] + beams["range"] * beams["d" + at] for at in ("x", "y")], axis=1)
    size, chosen = END_SQUARE, _one_of_each_square(ends, END_SQUARE)
    while len(chosen) > FIELD_POINTS:
        size *= CELL_GROWTH
        chosen = _one_of_each_square(ends, size)
    mixed: Floats = ends[np.random.default_rng(0).permutation(chosen)]
    return mixed


def _one_of_each_square(points: Floats, size: float) -> Integers:
    """Return the indices of points (n, 2), one for each square of `size` metres with points."""
    columns, rows = np.floor(points / size).astype(np.int64).T
    return np.asarray(np.unique(columns * SQUARES_ACROSS + rows, return_index=True)[1])


def _at_all_headings(points: Floats, cell: float) -> _TurnedPoints:
    """Turn points by steps at which those that are far move by about one cell."""
    far = float(np.quantile(np.hypot(*points.T), 0.9))
    count = max(1, math.ceil(math.tau * far / cell))
    headings = np.arange(count) * (math.tau / count)
    c, s = np.cos(headings)[:, None], np.sin(headings)[:, None]
    x, y = c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]
    cells = np.round(np.stack([y, x], axis=2) / cell).astype(np.int32)
    return _TurnedPoints(headings.astype(np.float64), cells)


def _poses_of(context: SearchContext, field: LikelihoodField, turned: _TurnedPoints, found: Records) -> Records:
    """Return the poses of cells, (k,) of `FOUND`, moved to where the beams fit."""
    shape = field.shape[0]
    poses = np.zeros(len(found), ESTIMATE)
    poses["theta"] = turned.headings[found["heading"]]
    poses["x"] = shape["x0"] + (found["column"] + 0.5) * shape["cell"]
    poses["y"] = shape["y0"] + (found["row"] + 0.5) * shape["cell"]
    beam_evidence_at(context, poses, MOST_BEAMS, len(poses))
    moved = np.zeros(len(found), FOUND)
    for name in ("theta", "x", "y"):
        moved[name] = poses[name]
    return moved
