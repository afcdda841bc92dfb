"""Search the last view of a drive alone, where the drive as a whole is not usable.

The models of the verdict were fitted to scans from one place. Each view of a drive adds clutter, blocked
lines of sight, and errors of odometry beyond the stated ones. The last view may fix the pose nevertheless. The drive
remains evidence: the answer of the last view is used only where the best pose of the drive agrees.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from registration import Beams, MeasuredSegments, RigidTransform, Segments, wrap_angle
from registration.values import value

from .context import SearchContext
from .report import report
from .result import AssociationResult, AssociationWarning
from .scan.scan import Indices, Scan, Views
from .to_scale import ScaledSearch, search_to_scale
from .tuning import AGREED_ANGLE, AGREED_CAUTIOUS, DISTINCT_DISTANCE
from .verdict.verdict import Verdict, judge
from .warnings import warnings_of_scan

LAST_VIEW_ONLY = AssociationWarning(
    "last_view_only",
    "The views of the drive together are not usable, the last view alone is, and both agree on the pose. The answer is "
    "that of the last view alone: check the covariance of the steps, and whether the map shows what the drive passed.",
)


@value(frozen=True, slots=True)
class LastView:
    """Result of the last view alone.

    Attributes
    ----------
    result : AssociationResult or None
        The answer for the drive, usable, with the indices of the drive's segments; None where there is none.
    complete : bool
        False where the deadline ended the search of it.
    found : ScaledSearch or None
        Its search; None where there was none.
    verdict : Verdict or None
        On that, whether or not it stands for the drive.
    """

    result: AssociationResult | None
    complete: bool = True
    found: ScaledSearch | None = None
    verdict: Verdict | None = None


NO_LAST_VIEW = LastView(None)


def search_last_view(context: SearchContext, verdict: Verdict) -> LastView:
    """Search the last view of a drive that is not usable alone, and return its answer where it may stand for the drive.

    The answer is used if it is usable, and the drive's best pose agrees within `DISTINCT_DISTANCE` and `AGREED_ANGLE`.
    The cautious probability of the drive must also be at least `AGREED_CAUTIOUS`. The last view consists of all views
    whose pose in the scan's frame is exact.

    Parameters
    ----------
    context : SearchContext
        Of the drive.
    verdict : Verdict
        Of the drive.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    speaks_for = verdict.pose is not None and not verdict.contradicted and verdict.cautious >= AGREED_CAUTIOUS
    if verdict.usable or not speaks_for:
        return NO_LAST_VIEW
    scan, own = last_view(context.scan)
    if not 0 < len(own) < len(context.scan.measured):
        return NO_LAST_VIEW
    if context.deadline.passed:
        return LastView(None, complete=False)
    alone = SearchContext.of(context.index, scan, context.prior, context.options, context.deadline)
    found = search_to_scale(alone)
    judged = judge(found.context, found.explanations, off_scale=found.off_scale)
    if not judged.usable or not _agree(judged.pose, verdict.pose):
        return LastView(None, judged.complete, found, judged)
    result = report(found, judged)
    if not result.usable:
        return LastView(None, complete=False)
    return LastView(_of_the_drive(context, result, own), True, found, judged)


def last_view(scan: Scan) -> tuple[Scan, Indices]:
    """Return the views of a scan whose poses are exact, and which of its segments they show, (k,).

    Nothing where no view is, or all are: those are several sensors, or a drive of which no error is known.
    """
    views = scan.views
    if views is None or not views.uncertain:
        return scan, np.zeros(0, np.intp)
    exact: NDArray[np.bool_] = ~np.any(views.root.reshape(len(views), -1), axis=1)
    segments, beams = exact[views.of_segment], exact[views.of_beam]
    own = np.flatnonzero(segments)
    number = np.cumsum(exact) - 1
    some = Views(
        poses=tuple(pose for pose, one in zip(views.poses, exact, strict=True) if one),
        viewpoints=views.viewpoints[exact],
        of_segment=number[views.of_segment[segments]],
        of_beam=number[views.of_beam[beams]],
        root=np.zeros((3 * int(exact.sum()), 0)),
        found=np.zeros(0),
        spread=np.eye(0),
    )
    alone = _of_one_place(_measured(scan.measured, own), _beams(scan.beams, beams), some)
    return replace(alone, ordered=scan.ordered, warnings=scan.warnings), own


def _of_one_place(measured: MeasuredSegments, beams: Beams | None, views: Views) -> Scan:
    """Return a scan of several views; of one in the scan's frame, that scan itself."""
    if len(views) > 1:
        return Scan(measured, views.viewpoint, beams, views)
    return Scan(measured, views.viewpoint, beams and replace(beams, origins=None), None)


def _measured(measured: MeasuredSegments, own: Indices) -> MeasuredSegments:
    return MeasuredSegments(
        Segments.derived(measured.segments.endpoints[own]),
        measured.sigma[own],
        measured.point_counts[own],
        measured.centroids[own],
        measured.spreads[own],
        measured.counted,
    )


def _beams(beams: Beams | None, own: NDArray[np.bool_]) -> Beams | None:
    if beams is None or beams.origins is None:
        return None
    return Beams(beams.angles[own], beams.ranges[own], beams.range_max, beams.origins[own])


def _agree(one: RigidTransform | None, other: RigidTransform | None) -> bool:
    if one is None or other is None:
        return False
    away = math.hypot(one.x - other.x, one.y - other.y)
    return away <= DISTINCT_DISTANCE and abs(wrap_angle(one.theta - other.theta)) <= AGREED_ANGLE


def _of_the_drive(context: SearchContext, result: AssociationResult, own: Indices) -> AssociationResult:
    """Return an answer with the indices of the drive's segments; the segments of the other views are unmatched.

    Warnings about the scan of the drive are included: their causes may be why the drive is not usable.
    """
    pairs = tuple(replace(pair, scan=int(own[pair.scan])) for pair in result.correspondences)
    unmatched = np.ones(len(context.scan.measured), dtype=bool)
    unmatched[own] = False
    unmatched[own[list(result.unmatched_scan)]] = True
    diagnostics = result.diagnostics
    if diagnostics is not None and diagnostics.critical_wall is not None:
        wall = replace(diagnostics.critical_wall, scan=tuple(own[list(diagnostics.critical_wall.scan)].tolist()))
        diagnostics = replace(diagnostics, critical_wall=wall)
    of_drive = {one.code: one for one in (*result.warnings, *warnings_of_scan(context))}
    return replace(
        result,
        correspondences=pairs,
        unmatched_scan=tuple(np.flatnonzero(unmatched).tolist()),
        diagnostics=diagnostics,
        warnings=(*of_drive.values(), LAST_VIEW_ONLY),
    )
