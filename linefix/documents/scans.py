"""Scans of a request to scans of the search, or to segments."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from association import AssociationWarning, Scan, View, assemble, mirrored
from registration import IDENTITY, MeasuredSegments, RigidTransform, Segments
from vectorization import (
    LaserScan,
    Motion,
    Vectorization,
    VectorizationError,
    VectorizationOptions,
    require_angle_max,
    vectorize,
)

from ..ranges import RangeScan, motion_warning, view_of
from .errors import Fault, InvalidRequestError, fault_of
from .requests import VectorizeRequest
from .sensors import Laser, MeasuredFields, OneScan, OneView, PointFields, RangeFields, Twist, ViewsScan
from .strict import Pose

OF_OPTIONS = ("sigma", "min_points", "min_length", "max_gap")
MOST_NULLS = 1.0 / 3.0  # fraction of a scan's ranges
LONGEST_LEVER = 5.0  # m; a view farther from the scan's frame is one of a drive, not of a scanner on the robot


def transform_of(pose: Pose) -> RigidTransform:
    """Return a pose as a transform."""
    return RigidTransform(pose.x, pose.y, pose.theta)


def measured_of(scan: MeasuredFields, argument: str = "scan") -> MeasuredSegments:
    """Return segments with what is known of their points; `argument` is what errors call the scan."""
    segments = Segments.from_array(scan.segments, argument=f"{argument}.segments")
    moments = None
    if scan.centroids is not None and scan.spreads is not None:
        moments = (scan.centroids, scan.spreads)
    return MeasuredSegments.from_segments(segments, scan.sigma, scan.point_counts, moments, argument=argument)


@dataclass(frozen=True, slots=True)
class Scanned:
    """A scan, and its segments where the caller did not send them.

    Attributes
    ----------
    scan : Scan
    sent : tuple of bool
        Of each view whether its segments were sent.
    starts : (v,) or None
        Of several views, which segment of the scan is the first of each.
    """

    scan: Scan
    sent: tuple[bool, ...]
    starts: NDArray[np.intp] | None = None

    @property
    def listed(self) -> list[Any] | None:
        """The segments that the caller did not send; of several views one list, or None, each."""
        rows = self.scan.measured.segments.endpoints
        if self.starts is None:
            return None if self.sent[0] else rows.tolist()
        parts = zip(np.split(rows, self.starts[1:]), self.sent, strict=True)
        return [None if sent else own.tolist() for own, sent in parts]


def scanned_of(scan: OneScan | ViewsScan, *, timed: bool = True) -> Scanned:
    """Return the robot's scan, whatever form it came in.

    If not `timed`, an unknown motion during a scan counts as none.
    """
    parts = {"": scan} if not isinstance(scan, ViewsScan) else {f"/views/{k}": one for k, one in enumerate(scan.views)}
    views = [_view_of(one, f"/scan{place}", timed=timed) for place, one in parts.items()]
    sent = tuple(isinstance(one, MeasuredFields) for one in parts.values())
    frame_id, stamp, header = scan.frame_id, scan.stamp, getattr(getattr(scan, "laser", None), "header", None)
    if header is not None:  # what the scan does not say itself
        frame_id = frame_id if "frame_id" in scan.model_fields_set else header.frame_id or frame_id
        stamp = header.stamp if stamp is None else stamp
    counts = np.array([len(view.scan.measured) for view in views])
    starts = np.cumsum(counts) - counts if isinstance(scan, ViewsScan) else None
    return Scanned(replace(assemble(views), frame_id=frame_id, stamp=stamp), sent, starts)


def _view_of(seen: OneScan | OneView, place: str, *, timed: bool) -> View:
    """Return what one sensor saw, from where it stood; `place` is the pointer of it."""
    pose, covariance, relative_to = IDENTITY, None, None
    if isinstance(seen, OneView):
        pose, covariance, relative_to = transform_of(seen.pose), seen.covariance, seen.relative_to
    flipped = bool(getattr(seen, "flipped", False))
    viewpoint = _viewpoint_of(seen.viewpoint)
    if isinstance(seen, RangeFields):
        ranges = replace(_range_scan(seen.laser, seen.twist, place, timed=timed), flipped=flipped)
        if relative_to is not None or covariance is not None or math.hypot(pose.x, pose.y) > LONGEST_LEVER:
            return _of_drive(_laser_view(ranges, pose, seen, place), covariance, relative_to)
        # It turns with the robot, whose frame is that of the scan.
        return _laser_view(replace(ranges, mount=pose), IDENTITY, seen, place)
    if isinstance(seen, PointFields):
        with _naming_argument(place):
            found = vectorize(seen.points, VectorizationOptions(sigma=seen.sigma), viewpoint)
        scan = Scan(found.measured, viewpoint, ordered=found.ordered)
    else:
        scan = Scan(measured_of(seen, place[1:].replace("/", ".")), viewpoint)
    return View(mirrored(scan) if flipped else scan, pose, covariance, relative_to)


def _laser_view(ranges: RangeScan, pose: RigidTransform, seen: RangeFields, place: str) -> View:
    """Return a scanner's view; the single beams stay evidence. `pose` is that of the frame it is mounted on."""
    with _naming_argument(place, "/laser"):
        view = view_of(ranges, pose, seen.sigma)
    nulls = _nulls_warning(ranges.laser)
    if nulls is not None:
        view = replace(view, scan=replace(view.scan, warnings=(*view.scan.warnings, nulls)))
    if getattr(seen, "viewpoint", None) is not None:
        return view
    return replace(view, scan=replace(view.scan, viewpoint=None, beams=None))


def _of_drive(view: View, covariance: NDArray[np.float64] | None, relative_to: int | None) -> View:
    """Return a view of a drive: scanners of one robot share its unknown motion, each view of a drive has its own."""
    own = None if view.motion is None else view.motion @ view.motion.T
    parts = [one for one in (covariance, own) if one is not None]
    return replace(view, covariance=sum(parts[1:], parts[0]) if parts else None, relative_to=relative_to, motion=None)


def _range_scan(laser: Laser, twist: Twist | None, place: str, *, timed: bool = True) -> RangeScan:
    """Return the ranges of a scanner; `place` is the pointer of its scan."""
    bounds = {"range_min": laser.range_min, "range_max": laser.range_max}
    motion = None
    if twist is not None and laser.time_increment:
        motion = Motion(laser.time_increment, twist.vx, twist.vy, twist.omega)
    with _naming_argument(place, "/laser"):
        if laser.angle_max is not None and len(laser.ranges):
            require_angle_max(laser.angle_min, laser.angle_max, laser.angle_increment, len(laser.ranges))
        given = {name: bound for name, bound in bounds.items() if bound is not None}
        scan = LaserScan(laser.angle_min, laser.angle_increment, laser.ranges, motion=motion, **given)
    return RangeScan(scan, (timed and laser.time_increment) or 0.0)


def _viewpoint_of(place: list[float] | None) -> tuple[float, float] | None:
    """Return where the sensor stood, metres; None where the scan is not from one place."""
    return None if place is None else (place[0], place[1])


def _nulls_warning(laser: LaserScan) -> AssociationWarning | None:
    """Return the warning about nulls that may stand for beams without a return; None where that is unlikely."""
    nulls = int(np.isnan(laser.ranges).sum())  # strict JSON has no other NaN
    if nulls <= MOST_NULLS * len(laser.ranges) or (laser.ranges > laser.range_max).any():
        return None
    return AssociationWarning(
        "nulls_for_no_return",
        f"{nulls} of {len(laser.ranges)} ranges are null, and none exceeds range_max. A null beam is unknown and gives "
        "no evidence. If these beams had no return, send a number above range_max: some JSON bridges write infinity as "
        "null.",
    )


@contextmanager
def _naming_argument(scan: str, form: str = "", options: str = "") -> Iterator[None]:
    """Name the place of an argument that the vectorizer rejects; `form` and `options` go after that of the scan."""
    try:
        yield
    except VectorizationError as error:
        below = options if error.argument in OF_OPTIONS else "" if error.argument == "twist" else form
        fault = fault_of(error)
        raise InvalidRequestError([Fault(f"{scan}{below}{fault.pointer}", fault.message)]) from error


def vectorization_of(asked: VectorizeRequest) -> tuple[Vectorization, AssociationWarning | None]:
    """Return the segments of a scan, and the warning about a sensor whose motion is not known.

    Raises
    ------
    InvalidRequestError
        When the library rejects it.
    """
    options = VectorizationOptions(**dict(asked.options))
    if asked.laser is None:
        assert asked.points is not None  # the model takes exactly one of the two
        with _naming_argument("", options="/options"):
            return vectorize(asked.points, options, _viewpoint_of(asked.viewpoint)), None
    seen = _range_scan(asked.laser, asked.twist, "")
    with _naming_argument("", "/laser", "/options"):
        return vectorize(seen.laser, options), motion_warning(seen)
