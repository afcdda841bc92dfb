"""Request models to the inputs of the libraries."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from association import PARTS, AssociationOptions, HardPrior, Prior, Scan, SoftPrior, View, assemble, mirrored
from linefix.answers import Included
from linefix.documents.errors import Fault, InvalidRequestError
from linefix.documents.parts import (
    HardPriorFields,
    LaserScan,
    MeasuredFields,
    PointScan,
    SearchOptions,
    SegmentScan,
    SoftPriorFields,
    is_oriented,
)
from linefix.documents.requests import CheckRequest, RegisterRequest
from linefix.documents.strict import Pose
from linefix.documents.views import LaserView, PointView, SegmentView, ViewsScan
from registration import (
    IDENTITY,
    InputError,
    InvalidArgumentError,
    MeasuredSegments,
    RegistrationOptions,
    RigidTransform,
    Segments,
)

from .scans import Scanned, range_scan, scan_points, view_laser, viewpoint_of

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


def scanned_of(scan: SegmentScan | LaserScan | PointScan | ViewsScan, *, timed: bool = True) -> Scanned:
    """Return the robot's scan, whatever form it came in.

    If not `timed`, an unknown motion during a scan counts as none.
    """
    if isinstance(scan, ViewsScan):
        return _of_views(scan, timed=timed)
    viewpoint = viewpoint_of(scan.viewpoint)
    if isinstance(scan, LaserScan):
        seen = range_scan(scan.laser, scan.twist, "/scan", timed=timed)
        return _vectorized(assemble([view_laser(seen, IDENTITY, scan.sigma, viewpoint)]))
    if isinstance(scan, PointScan):
        return _vectorized(scan_points(scan.points, scan.sigma, viewpoint))
    return Scanned(Scan(measured_of(scan), viewpoint), None)


def _vectorized(scan: Scan) -> Scanned:
    return Scanned(scan, scan.measured.segments.endpoints)


def _of_views(scan: ViewsScan, *, timed: bool) -> Scanned:
    views = [_view_of(view, k, timed=timed) for k, view in enumerate(scan.views)]
    together = assemble(views)
    counts = np.array([len(view.scan.measured) for view in views])
    starts = np.cumsum(counts) - counts
    rows = np.split(together.measured.segments.endpoints, starts[1:])
    sent = (isinstance(view, SegmentView) for view in scan.views)
    parts = tuple(None if as_sent else own for own, as_sent in zip(rows, sent, strict=True))
    return Scanned(together, None, parts, starts)


def _view_of(view: SegmentView | LaserView | PointView, number: int, *, timed: bool) -> View:
    """Return what one sensor saw, from where it stood."""
    viewpoint, place = viewpoint_of(view.viewpoint), f"/scan/views/{number}"
    if isinstance(view, LaserView):
        return _laser_view(view, place, timed=timed)
    if isinstance(view, PointView):
        seen = scan_points(view.points, view.sigma, viewpoint, place)
    else:
        seen = Scan(measured_of(view, f"scan.views.{number}"), viewpoint)
    seen = mirrored(seen) if view.flipped else seen
    return View(seen, transform_of(view.pose), view.covariance, view.relative_to)


def _laser_view(view: LaserView, place: str, *, timed: bool) -> View:
    """Return a scanner's view; scanners on one robot share its unknown motion, views of a drive have each their own."""
    at = transform_of(view.pose)
    seen = replace(range_scan(view.laser, view.twist, place, timed=timed), flipped=view.flipped)
    if view.relative_to is None and view.covariance is None and math.hypot(at.x, at.y) <= LONGEST_LEVER:
        # It turns with the robot, whose frame is that of the scan.
        return view_laser(replace(seen, mount=at), IDENTITY, view.sigma, viewpoint_of(view.viewpoint), place)
    found = view_laser(seen, at, view.sigma, viewpoint_of(view.viewpoint), place)
    own = None if found.motion is None else found.motion @ found.motion.T
    parts = [one for one in (view.covariance, own) if one is not None]
    covariance = sum(parts[1:], parts[0]) if parts else None
    return replace(found, covariance=covariance, relative_to=view.relative_to, motion=None)


def prior_of(prior: SoftPriorFields | HardPriorFields | None) -> Prior | None:
    """Return the prior of the pose; None without one."""
    if prior is None:
        return None
    if isinstance(prior, SoftPriorFields):
        return SoftPrior(transform_of(prior), prior.covariance)
    return HardPrior(transform_of(prior), prior.radius, prior.angle)


def association_options_of(options: SearchOptions, *, oriented: bool) -> AssociationOptions:
    """Return how to search a map whose directions count, or do not."""
    return AssociationOptions(
        max_alternatives=options.max_alternatives,
        confidence=options.confidence,
        exhaustive=options.exhaustive,
        seed=options.seed,
        sampling=options.sampling,
        oriented=oriented,
        offset_tolerance=options.offset_tolerance,
        angle_tolerance=options.angle_tolerance,
        min_overlap=options.min_overlap,
        parts=tuple(part for part in PARTS if part in options.include),
        on_map=options.on_map,
        usable_from=options.usable_from,
        estimator=options.estimator,
        rotation=options.rotation,
    )


def included_of(
    scan: SegmentScan | LaserScan | PointScan | ViewsScan, options: SearchOptions, scanned: Scanned, frame_id: str
) -> Included:
    """Return the fields that the answer repeats of a request; `frame_id` is the map's."""
    parts = frozenset[str](options.include)
    segments = scanned.listed if "segments" in parts else None
    return Included(parts, frame_id, scan.told_frame_id, scan.told_stamp, segments, scanned.starts)


def registration_options_of(asked: RegisterRequest) -> RegistrationOptions:
    """Return how to register."""
    options = asked.options
    return RegistrationOptions(
        estimator=options.estimator,
        rotation=options.rotation,
        k_translation=options.k_translation,
        k_rotation=options.k_rotation,
        evaluate_at=None if options.evaluate_at is None else transform_of(options.evaluate_at),
        oriented=is_oriented(options.oriented, asked.map.oriented),
        weighting=asked.weighting,
        weights=asked.weights,
    )


def pairs_of(asked: RegisterRequest, map_count: int, scan_count: int) -> NDArray[np.intp]:
    """Return the correspondences; i with i where none are given.

    Raises
    ------
    InvalidArgumentError
        When none are given and the sets differ in length.
    """
    if asked.correspondences is not None:
        return asked.correspondences.astype(np.intp)
    if map_count != scan_count:
        raise InvalidArgumentError(
            f"found none, with {scan_count} scan and {map_count} map segments; expected pairs, or equal counts",
            argument="correspondences",
        )
    return np.repeat(np.arange(map_count, dtype=np.intp)[:, None], 2, axis=1)


def scans_of(asked: CheckRequest) -> list[Scan]:
    """Return the sample scans of a request.

    Raises
    ------
    InvalidRequestError
        When the libraries reject one.
    """
    found = []
    for number, one in enumerate(asked.scans):
        with naming_scan(f"/scans/{number}"):
            # A motion that is not known would only loosen the fit.
            found.append(scanned_of(one, timed=False).scan)
    return found


@contextmanager
def naming_scan(place: str) -> Iterator[None]:
    """Name the place of a scan in the request, where the libraries refuse the scan.

    Raises
    ------
    InvalidRequestError
        With pointers below `place`, in place of `/scan`.
    """
    try:
        yield
    except (InvalidRequestError, InputError) as error:
        faults = error.faults if isinstance(error, InvalidRequestError) else (fault_of(error),)
        moved = [Fault(place + one.pointer.removeprefix("/scan"), one.message) for one in faults]
        raise InvalidRequestError(moved) from error


def fault_of(error: InputError) -> Fault:
    """Return the place of a request that a library refuses; its arguments are named as fields, with dots."""
    index = "" if error.index is None else f"/{error.index}"
    return Fault("/" + error.argument.replace(".", "/") + index, error.message)
