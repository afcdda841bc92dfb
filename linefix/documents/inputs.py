"""Request models to the inputs of the libraries."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from association import (
    INCLUDED,
    AssociationOptions,
    Deadline,
    HardPrior,
    MapIndex,
    MapPart,
    MapPoints,
    Prior,
    Scan,
    SoftPrior,
    View,
    assemble,
    mirrored,
)
from map_quality import NOT_SHARPENED, Analysis, Replacement, Robot, Sharpened, VisitScan
from registration import (
    IDENTITY,
    InputError,
    InvalidArgumentError,
    MeasuredSegments,
    RegistrationOptions,
    RigidTransform,
    Segments,
)

from .analysis import AnalyzeRequest
from .errors import Fault, InvalidRequestError
from .parts import (
    HardPriorFields,
    LaserScan,
    MapDocument,
    MeasuredFields,
    PointScan,
    SearchOptions,
    SegmentScan,
    SoftPriorFields,
    is_oriented,
)
from .requests import CheckRequest, RegisterRequest
from .results import Included
from .scans import Scanned, range_scan, scan_points, view_laser, viewpoint_of
from .strict import Pose
from .updates import ApplyRequest, ProposedChange, SharpenedWalls, UpdateRequest, UpdateScan
from .views import LaserView, PointView, SegmentView, ViewsScan

# Options of a search that have the same names and values in a request.
_AS_SENT = [one.name for one in fields(AssociationOptions) if one.name not in ("oriented", "include")]
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
        seen = replace(seen, flipped=isinstance(scan, UpdateScan) and scan.flipped)
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
    include = tuple(part for part in INCLUDED if part in options.include)
    return AssociationOptions(oriented=oriented, include=include, **{name: getattr(options, name) for name in _AS_SENT})


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
        evaluate_at=None if options.evaluate_at is None else transform_of(options.evaluate_at),
        oriented=is_oriented(options.oriented, asked.map.oriented),
        weighting=asked.weighting,
        weights=asked.weights,
        **{name: getattr(options, name) for name in ("estimator", "rotation", "k_translation", "k_rotation")},
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


def scans_of(asked: CheckRequest) -> Iterator[Scan]:
    """Yield the sample scans of a request.

    Raises
    ------
    InvalidRequestError
        When the libraries reject one.
    """
    for number, one in enumerate(asked.scans):
        with naming_scan(f"/scans/{number}"):
            # A motion that is not known would only loosen the fit.
            yield scanned_of(one, timed=False).scan


def visit_scans(asked: UpdateRequest) -> Iterator[VisitScan]:
    """Yield the scans of all visits; an error names the place of a scan in the request."""
    for number, visit in enumerate(asked.visits):
        for place, one in enumerate(visit.scans):
            with naming_scan(f"/visits/{number}/scans/{place}"):
                pose = None if one.pose is None else transform_of(one.pose)
                odometry = None if one.odometry is None else transform_of(one.odometry)
                yield VisitScan(scanned_of(one).scan, visit.visit, pose, one.covariance, odometry)


def analysis_of(index: MapIndex, asked: AnalyzeRequest) -> Analysis:
    """Return the analysis of a map that a request is for.

    Raises
    ------
    AnalysisError
        When the requested places cannot be had.
    InputError
        When a segment of the landmark is too short or too long.
    """
    laser = asked.laser
    robot = Robot(laser.fov, laser.beams, laser.range_max, laser.sigma)
    landmark = Segments.from_array(asked.landmark, argument="landmark")
    return Analysis.over(
        index, robot, asked.spacing, asked.point, seed=asked.seed, drive=asked.drive, landmark=landmark
    )


def part_of(document: MapDocument, *, oriented: bool, path: str = "map.") -> MapPart:
    """Return a map as the search takes it; `path` goes before the fields that errors name."""
    segments = Segments.from_array(document.segments, argument=f"{path}segments")
    points = MapPoints.of(document.points, document.points_sigma, path=path)
    return MapPart(segments, document.sigma, oriented, points)


def require_map(document: MapDocument, path: str = "") -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower left and the upper right corner of the walls of a map.

    Raises
    ------
    InvalidSegmentsError, InvalidMapError
        When it could not be searched.
    """
    part = part_of(document, oriented=True, path=path)
    return MapIndex.require(part.segments, part.sigma, path)


def index_of(document: MapDocument, *, oriented: bool, deadline: Deadline | None = None) -> MapIndex:
    """Return the index of a map; raises `IndexingEndedError` when the deadline passes."""
    part = part_of(document, oriented=oriented)
    return MapIndex.build(part.segments, part.sigma, oriented=oriented, points=part.points, deadline=deadline)


def replacements_of(asked: ApplyRequest) -> dict[int, Replacement]:
    """Return the accepted changes of a map, by their indices in the request."""
    return {number: _replacement_of(one, number) for number, one in enumerate(asked.changes) if one.accepted}


def _replacement_of(one: ProposedChange, number: int) -> Replacement:
    new = Segments.from_array([each.segment for each in one.new], argument=f"changes.{number}.new")
    return Replacement(one.code, tuple(one.segments), new.endpoints, np.array([each.sigma for each in one.new]))


def sharpened_of(asked: SharpenedWalls | None) -> Sharpened:
    """Return the walls at better positions; none where there are none."""
    if asked is None:
        return NOT_SHARPENED
    ends = Segments.from_array(asked.ends, argument="sharpened.ends").endpoints
    return Sharpened(np.array(asked.segments, dtype=np.intp), ends, np.array(asked.sigma))


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
