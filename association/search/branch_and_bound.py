"""Search for poses by the points of beams: branch and bound over the likelihood field of the map.

Bases need two walls that are found in scan and map. If clutter hides walls, or if a map made by a robot has many short
pieces, there may be none at the truth. The ends of the beams alone then give the pose that bases miss.
"""

from __future__ import annotations

import math

import numpy as np

from registration import RigidTransform
from registration.layout import Floats, Records
from registration.values import value

from ..consensus.beams import beam_evidence_at, rays_of
from ..consensus.tuning import LEAST_POINTS, MOST_BEAMS
from ..context import SearchContext
from ..deadline import CancelledError
from ..index.likelihood_field import LikelihoodField
from ..index.tuning import CELL_GROWTH
from ..layout import ESTIMATE, FOUND, Integers
from ..tuning import COMPARED_BEAMS, DISTINCT_ANGLE, DISTINCT_DISTANCE, SAME_PLACE
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


@value(frozen=True, slots=True)
class PointMatches:
    """The poses at which most of the beams end on walls.

    Attributes
    ----------
    poses : (k,) of `FOUND`, the best first
        All poses within `FIELD_GAP` of the best one, if the search is complete.
    means : (k,) float64
        Mean likelihood of the ends of beams at each, 0 to 1.
    least : float
        No place with a greater mean was missed, if the search is complete.
    complete : bool
        False if the deadline ended the search.
    """

    poses: Records
    means: Floats
    least: float
    complete: bool

    @property
    def decisive(self) -> RigidTransform | None:
        """The best pose in the index frame, if it explains the scan well and no other place does nearly as well."""
        if not self.complete or not len(self.poses):
            return None
        if self.means[0] < max(WELL_EXPLAINED, self.least + FIELD_GAP):
            return None
        best, others = self.poses[0], self.poses[1:]
        away = np.hypot(others["x"] - best["x"], others["y"] - best["y"])
        turned = np.abs((others["theta"] - best["theta"] + math.pi) % math.tau - math.pi)
        if ((away > SAME_PLACE) | (turned > 2.0 * DISTINCT_ANGLE)).any():
            return None
        return RigidTransform(float(best["x"]), float(best["y"]), float(best["theta"]))


def match_points(context: SearchContext, candidates: Records, answer: Records) -> PointMatches | None:
    """Search for the poses at which most of the beams end on walls.

    Returns None if the answer explains most beams, as well as any candidate; without beams, with a hard prior, on a
    map that is too large for a likelihood field, and after the deadline.

    Parameters
    ----------
    context : SearchContext
    candidates : (k,) of `FOUND`
        The poses of bases.
    answer : (1,) or (0,) of `FOUND`
        The pose of the answer so far; empty if it has none.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    points = _points_of(context)
    if len(points) < LEAST_POINTS:
        return None
    field = context.index.likelihood_field
    if field is None:
        return None
    reached, own = (greatest_mean(field.pyramid[0], field.shape, points, poses) for poses in (candidates, answer))
    if own >= max(WELL_EXPLAINED, reached - FIELD_GAP):
        return None
    cell = float(field.shape["cell"][0])
    turned = _at_all_headings(points, cell)
    found = np.zeros(KEPT, CELL_POSE)
    # In the cells of the field the best pose has less than a candidate between two of them.
    least = max(FIELD_LEAST, reached - 2.0 * FIELD_GAP)
    least_value, gap = (round(255.0 * len(points) * mean) for mean in (least, FIELD_GAP))
    apart = math.ceil(DISTINCT_DISTANCE / cell), math.ceil(DISTINCT_ANGLE / math.tau * len(turned.headings))
    with context.deadline.watched() as stop:
        count = branch_and_bound(field.pyramid, turned.cells, least_value, gap, *apart, found, stop)
        interrupted = bool(stop[0])
    if context.deadline.cancelled:
        raise CancelledError
    found = found[:count][np.argsort(-found["value"][:count], kind="stable")]
    means = found["value"] / (255.0 * len(points))
    near = means >= means.max(initial=0.0) - FIELD_GAP  # the best was not known when the first were found
    return PointMatches(_poses_of(context, field, turned, found[near]), means[near], least, not interrupted)


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
