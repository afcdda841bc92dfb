"""Request models to what the libraries take."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from association import PARTS, AssociationOptions, HardPrior, Prior, Scan, SoftPrior, View, assemble, mirrored
from registration import InvalidArgumentError, MeasuredSegments, RegistrationOptions, RigidTransform, Segments

from ..maps.lookup import is_oriented
from ..schemas.parts import (
    HardPriorFields,
    LaserScan,
    MeasuredFields,
    PointScan,
    SearchOptions,
    SegmentScan,
    SoftPriorFields,
)
from ..schemas.requests import RegisterRequest
from ..schemas.strict import Pose
from ..schemas.views import LaserView, PointView, SegmentView, ViewsScan
from .scanning import Scanned, scan_laser, scan_points, viewpoint_of


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


def scanned_of(scan: SegmentScan | LaserScan | PointScan | ViewsScan) -> Scanned:
    """Return what the robot saw, whatever form it came in."""
    if isinstance(scan, ViewsScan):
        return _of_views(scan)
    viewpoint = viewpoint_of(scan.viewpoint)
    if isinstance(scan, LaserScan):
        return _vectorized(scan_laser(scan.laser, scan.sigma, viewpoint, scan.twist))
    if isinstance(scan, PointScan):
        return _vectorized(scan_points(scan.points, scan.sigma, viewpoint))
    return Scanned(Scan(measured_of(scan), viewpoint), None)


def _vectorized(scan: Scan) -> Scanned:
    return Scanned(scan, scan.measured.segments.endpoints)


def _of_views(scan: ViewsScan) -> Scanned:
    views = [_view_of(view, k) for k, view in enumerate(scan.views)]
    together = assemble(views)
    counts = np.array([len(view.scan.measured) for view in views])
    starts = np.cumsum(counts) - counts
    rows = np.split(together.measured.segments.endpoints, starts[1:])
    sent = (isinstance(view, SegmentView) for view in scan.views)
    parts = tuple(None if as_sent else own for own, as_sent in zip(rows, sent, strict=True))
    return Scanned(together, None, parts, starts)


def _view_of(view: SegmentView | LaserView | PointView, number: int) -> View:
    """Return what one sensor saw, from where it stood."""
    viewpoint, place = viewpoint_of(view.viewpoint), f"/scan/views/{number}"
    if isinstance(view, LaserView):
        seen = scan_laser(view.laser, view.sigma, viewpoint, view.twist, place)
    elif isinstance(view, PointView):
        seen = scan_points(view.points, view.sigma, viewpoint, place)
    else:
        seen = Scan(measured_of(view, f"scan.views.{number}"), viewpoint)
    seen = mirrored(seen) if view.flipped else seen
    return View(seen, transform_of(view.pose), view.covariance, view.relative_to)


def prior_of(prior: SoftPriorFields | HardPriorFields | None) -> Prior | None:
    """Return what is known of the pose before."""
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
        causes="causes" in options.include,
        estimator=options.estimator,
        rotation=options.rotation,
    )


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
            f"left out, though there are {scan_count} scan and {map_count} map segments", argument="correspondences"
        )
    return np.repeat(np.arange(map_count, dtype=np.intp)[:, None], 2, axis=1)
