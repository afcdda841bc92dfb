"""Request models to what the libraries take."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from association import AssociationOptions, HardPrior, Prior, Scan, SoftPrior
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
from .scanning import Scanned, scan_laser, scan_points, viewpoint_of


def transform_of(pose: Pose) -> RigidTransform:
    """Return a pose as a transform."""
    return RigidTransform(pose.x, pose.y, pose.theta)


def measured_of(scan: MeasuredFields) -> MeasuredSegments:
    """Return segments with what is known of their points."""
    segments = Segments.from_array(scan.segments, argument="scan.segments")
    moments = None
    if scan.centroids is not None and scan.spreads is not None:
        moments = (scan.centroids, scan.spreads)
    return MeasuredSegments.from_segments(segments, scan.sigma, scan.points, moments, argument="scan")


def scanned_of(scan: SegmentScan | LaserScan | PointScan) -> Scanned:
    """Return what the robot saw, whatever form it came in."""
    viewpoint = viewpoint_of(scan.viewpoint)
    if isinstance(scan, LaserScan):
        return scan_laser(scan.laser, scan.sigma, viewpoint)
    if isinstance(scan, PointScan):
        return scan_points(scan.points, scan.sigma, viewpoint)
    return Scanned(Scan(measured_of(scan), viewpoint), None)


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
