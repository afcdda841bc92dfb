"""Types of requests and answers; `make client-types` makes them from the OpenAPI document."""

from __future__ import annotations

from typing import Any, Literal

from typing_extensions import NotRequired, TypedDict


class AdviceAnswer(TypedDict):
    """
    Recommended properties of the map; null: no recommendation.
    """

    sigma: float | None
    oriented: bool | None


class AmbiguityAnswer(TypedDict):
    """
    The paper's ambiguity, with the weights used.
    """

    translation: float
    rotation: float
    total: float


class AnalysisSummaryAnswer(TypedDict):
    """
    Counts of the places.
    """

    places: int
    usable: int
    ok: int
    ambiguous: int
    degenerate: int
    no_match: int
    similar_pose: int
    resolved_within: int | None
    usable_with_landmark: int | None
    not_free: int
    left_out: int


class CorrectionsAnswer(TypedDict):
    """
    Errors of the map around the sensor, or of the ranges, that were estimated together with the pose.
    """

    scale: float
    offset: float
    strain: list[float]


class CorrespondenceAnswer(TypedDict):
    """
    A scan segment found on a map segment.
    """

    scan: int
    map: int
    offset: float
    angle: float
    weight: float
    view: NotRequired[int | None]
    overlap: float
    alternatives: list[int]


EvidenceAnswer = TypedDict(
    "EvidenceAnswer",
    {
        "beams_through": int,
        "beams_on": int,
        "poses": int,
        "visits": int,
        "from": str,
        "to": str,
    },
)


class FindingAnswer(TypedDict):
    """
    A finding of a check.
    """

    code: Literal[
        "unlikely_size",
        "reversed",
        "mixed_directions",
        "short_pieces",
        "doubled_faces",
        "both_ways",
        "overlaps",
        "gaps",
        "looks_alike",
        "centre_lines",
        "thickness",
        "undirected",
        "mirrored",
        "scale",
        "moved",
    ]
    message: str
    segments: list[int]
    count: int


class HeldBackAnswer(TypedDict):
    """
    Scans that gave no evidence, and test the proposal.
    """

    scans: int
    usable_before: int
    usable_after: int


class ImportTimingAnswer(TypedDict):
    """
    Duration of an import, milliseconds.
    """

    read: float
    check: float
    total: float


class ImportedMapAnswer(TypedDict):
    """
    A map, as it may be stored or sent with a request.
    """

    segments: list[list[float]]
    sigma: float | None
    oriented: bool
    frame_id: str
    points: NotRequired[list[list[float]]]
    points_sigma: NotRequired[float | None]
    meta: Any


class KeptWallsAnswer(TypedDict):
    """
    Walls of the map that stay although beams of several visits pass through a part of them.
    """

    code: Literal["still_seen", "little_passed", "worse_without"]
    message: str
    segments: list[int]


class Limits(TypedDict):
    """
    Limits of requests; a request beyond one is rejected.
    """

    max_views: int
    max_beams_together: int
    max_segments_together: int
    max_magnitude: float
    min_segment_length: float
    max_segment_length: float
    max_map_extent: float
    searches: int
    queue: int
    max_body_bytes: int
    max_values: int
    max_bodies_bytes: int
    max_answers_bytes: int
    max_connections: int
    max_map_segments: int
    max_scan_segments: int
    max_beams: int
    max_correspondences: int
    max_batch: int
    max_deadline_ms: float
    request_timeout_s: float


class Live(TypedDict):
    """
    A probe's answer.
    """

    status: Literal["ok"]


class MapDocument(TypedDict):
    """
    A map, as a file of its own or to be stored.
    """

    segments: list[list[float]]
    sigma: NotRequired[float | None]
    oriented: NotRequired[bool | None]
    frame_id: NotRequired[str]
    points: NotRequired[list[list[float]]]
    points_sigma: NotRequired[float | None]
    meta: NotRequired[Any]


class MapReference(TypedDict):
    """
    Which map was searched; of several maps that of the pose.
    """

    map_id: str
    revision: int | None


class MapSummaryAnswer(TypedDict):
    """
    A stored map without its content.
    """

    map_id: str
    revision: int
    segment_count: int
    bounds: list[float]
    sigma: float | None
    oriented: bool | None


class NewMapAnswer(TypedDict):
    """
    The new map, as PUT takes it.
    """

    segments: list[list[float]]
    sigma: float | None
    oriented: bool | None
    frame_id: str
    points: NotRequired[list[list[float]]]
    points_sigma: NotRequired[float | None]
    meta: Any


class NewSegmentAnswer(TypedDict):
    """
    A segment of the new map.
    """

    segment: list[float]
    sigma: float


class NoteAnswer(TypedDict):
    """
    One thing that an import did.
    """

    code: str
    message: str
    count: int


class Place(TypedDict):
    """
    One fault of a request.
    """

    pointer: str
    message: str


class PoseAnswer(TypedDict):
    """
    The scan frame's pose in the map frame.
    """

    x: float
    y: float
    theta: float


class Problem(TypedDict):
    """
    An error, RFC 9457.
    """

    type: str
    title: str
    status: int
    detail: str
    code: Literal[
        "invalid_json",
        "invalid_http",
        "unauthorized",
        "forbidden",
        "not_found",
        "unknown_map",
        "method_not_allowed",
        "request_timeout",
        "map_corrupt",
        "revision_conflict",
        "too_large",
        "unsupported_media_type",
        "invalid_request",
        "rate_limited",
        "internal",
        "not_ready",
        "overloaded",
        "read_only",
        "deadline_exceeded",
        "storage_full",
    ]
    errors: NotRequired[list[Place]]
    request_id: str


class ReasonAnswer(TypedDict):
    """
    Why an answer is not usable.
    """

    code: Literal[
        "prior_contradicted",
        "search_incomplete",
        "not_on_map",
        "unobservable_direction",
        "similar_place",
        "single_wall",
        "map_mismatch",
        "insufficient_evidence",
    ]
    message: str


class RefusedVisitAnswer(TypedDict):
    """
    A visit that gives no evidence.
    """

    visit: str
    message: str


class RegistrationDiagnosticsAnswer(TypedDict):
    """
    Diagnostics of a registration.
    """

    ambiguity: AmbiguityAnswer
    ambiguity_before: AmbiguityAnswer
    ambiguity_at: AmbiguityAnswer | None
    similarity: float | None
    reliability: float
    determinant: float
    chi2: float
    dof: int
    rms_offset: float
    rms_angle: float
    pairs: int


class ReportAnswer(TypedDict):
    """
    Report of an import.
    """

    format: str
    files: list[str]
    read: list[NoteAnswer]
    merged: list[NoteAnswer]
    dropped: list[NoteAnswer]
    assumed: list[NoteAnswer]


class Residual(TypedDict):
    """
    Residuals of one pair.
    """

    scan: int
    map: int
    offset: float
    angle: float
    weight: float


class SampleAnswer(TypedDict):
    """
    Result of one scan in the map as it is.
    """

    index: int
    status: Literal["ok", "ambiguous", "degenerate", "no_match"] | None
    usable: bool
    pose: PoseAnswer | None


class SamplesAnswer(TypedDict):
    """
    Results of the sample scans.
    """

    usable: int
    usable_as_advised: int
    wall_thickness: float | None
    scans: list[SampleAnswer]


class ScansTimingAnswer(TypedDict):
    """
    Duration of reading a log, milliseconds.
    """

    read: float
    total: float


class SearchAnswer(TypedDict):
    """
    Statistics of the search.
    """

    complete: bool
    exhaustive: bool
    confidence: float
    bases: int
    hypotheses: int
    verified: int
    seed: int
    sampling: Literal["ordered", "random"]
    complete_above: float


class SegmentOfView(TypedDict):
    """
    A segment of a scan of several views.
    """

    view: int
    scan: int


class SharpenedAnswer(TypedDict):
    """
    Walls that are in the new map at better positions; only of a map that declares a sigma of 8 mm or more.
    """

    segments: list[int]
    ends: list[list[float]]
    sigma: list[float]


class SizeAnswer(TypedDict):
    """
    Size of a map.
    """

    segment_count: int
    walls: int
    length: float
    diagonal: float


class TimingAnswer(TypedDict):
    """
    Duration of the request, milliseconds.
    """

    decode: float
    search: float
    total: float


class Version(TypedDict):
    """
    Name and version of the service.
    """

    name: str
    version: str
    api: str


class WarningAnswer(TypedDict):
    """
    A warning about the scan, the map or the search.
    """

    code: Literal[
        "no_segments",
        "points_not_in_order",
        "motion_unknown",
        "nulls_for_no_return",
        "stuck_ranges",
        "scan_exceeds_map",
        "unlikely_map_size",
        "faces_away",
        "prior_contradicted",
        "search_incomplete",
        "map_scale",
        "common_offset",
        "map_distorted",
        "turned",
        "last_view_only",
    ]
    message: str


class WithLandmarkAnswer(TypedDict):
    """
    Result at a place with the landmark.
    """

    status: Literal["ok", "ambiguous", "degenerate", "no_match"]
    usable: bool
    probability: float | None


class HardPriorFields(TypedDict):
    """
    A window that must contain the answer.
    """

    x: float
    y: float
    theta: float
    radius: float
    angle: float
    map_id: NotRequired[str | None]


class Header(TypedDict):
    """
    The header of a LaserScan message: `stamp` and `frame_id` of the scan, where it says nothing of them itself.
    """

    stamp: NotRequired[Any]
    frame_id: NotRequired[str]
    seq: NotRequired[Any]


class InlineMap(TypedDict):
    """
    A map in the request itself.
    """

    segments: list[list[float]]
    sigma: NotRequired[float | None]
    oriented: NotRequired[bool | None]
    frame_id: NotRequired[str]
    points: NotRequired[list[list[float]]]
    points_sigma: NotRequired[float | None]
    meta: NotRequired[Any]


class KnownMap(TypedDict):
    """
    The map side of known correspondences.
    """

    segments: list[list[float]]
    sigma: NotRequired[float | None]
    oriented: NotRequired[bool | None]
    frame_id: NotRequired[str]
    points: NotRequired[list[list[float]]]
    points_sigma: NotRequired[float | None]
    meta: NotRequired[Any]


class Laser(TypedDict):
    """
    One turn of a scanner, as in a LaserScan message.
    """

    angle_min: float
    angle_increment: float
    ranges: list[float | None]
    range_min: NotRequired[float | None]
    range_max: NotRequired[float | None]
    header: NotRequired[Header | None]
    time_increment: NotRequired[float | None]
    angle_max: NotRequired[float | None]
    scan_time: NotRequired[Any]
    intensities: NotRequired[Any]


class MapPrefix(TypedDict):
    """
    All stored maps whose ids begin alike.
    """

    prefix: str


class MeasuredFields(TypedDict):
    """
    Segments of a scan with what is known of the points behind them.
    """

    segments: list[list[float]]
    sigma: NotRequired[float | list[float]]
    point_counts: NotRequired[list[float] | None]
    centroids: NotRequired[list[list[float]] | None]
    spreads: NotRequired[list[float] | None]


class NamedMap(TypedDict):
    """
    A map in the request itself, with a name for the answer.
    """

    segments: list[list[float]]
    sigma: NotRequired[float | None]
    oriented: NotRequired[bool | None]
    frame_id: NotRequired[str]
    points: NotRequired[list[list[float]]]
    points_sigma: NotRequired[float | None]
    meta: NotRequired[Any]
    map_id: str


class NewSegment(TypedDict):
    """
    A segment of the new map.
    """

    segment: list[float]
    sigma: float


class PointScan(TypedDict):
    """
    A scan as points in scanning order.
    """

    points: list[list[float]]
    sigma: NotRequired[float | None]
    frame_id: NotRequired[str]
    stamp: NotRequired[Any]
    viewpoint: NotRequired[list[float] | None]


class Pose(TypedDict):
    """
    The scan frame's pose in the map frame: ``p_map = R(theta) p_scan + [x, y]``.
    """

    x: float
    y: float
    theta: float


class ProposedChange(TypedDict):
    """
    A change as an update proposed it.
    """

    code: Literal["removed", "added", "moved", "extended", "shortened"]
    segments: list[int]
    new: list[NewSegment]
    evidence: NotRequired[Any]
    confidence: NotRequired[float | None]
    accepted: NotRequired[bool]


class ScannerFields(TypedDict):
    """
    The scanner that the robot carries.
    """

    fov: NotRequired[float]
    beams: NotRequired[int]
    range_max: NotRequired[float]
    sigma: NotRequired[float]


class SearchOptions(TypedDict):
    """
    How to search, and what to put into the answer.
    """

    max_alternatives: NotRequired[int]
    confidence: NotRequired[float]
    exhaustive: NotRequired[bool]
    seed: NotRequired[int]
    sampling: NotRequired[Literal["ordered", "random"]]
    deadline_ms: NotRequired[float | None]
    oriented: NotRequired[bool | None]
    offset_tolerance: NotRequired[float | None]
    angle_tolerance: NotRequired[float | None]
    min_overlap: NotRequired[float]
    on_map: NotRequired[float]
    usable_from: NotRequired[float]
    estimator: NotRequired[Literal["joint", "one_step"]]
    rotation: NotRequired[Literal["wahba", "mitsuta"]]
    include: NotRequired[list[Literal["correspondences", "alternatives", "segments", "missing_map"]]]


class SegmentScan(TypedDict):
    """
    A scan as segments.
    """

    segments: list[list[float]]
    sigma: NotRequired[float | list[float]]
    point_counts: NotRequired[list[float] | None]
    centroids: NotRequired[list[list[float]] | None]
    spreads: NotRequired[list[float] | None]
    frame_id: NotRequired[str]
    stamp: NotRequired[Any]
    viewpoint: NotRequired[list[float] | None]


class SensorPose(TypedDict):
    """
    The sensor's pose in the scan's frame: ``p_scan = R(theta) p_sensor + [x, y]``.
    """

    x: float
    y: float
    theta: float


class SharpenedWalls(TypedDict):
    """
    Walls at better positions, as an update returned them.
    """

    segments: list[int]
    ends: list[list[float]]
    sigma: list[float]


class SoftPriorFields(TypedDict):
    """
    A Gaussian over the pose. It is part of the score, and never fused into pose or covariance.
    """

    x: float
    y: float
    theta: float
    covariance: list[list[float]]
    map_id: NotRequired[str | None]


class StoredMap(TypedDict):
    """
    A map that was stored with PUT before.
    """

    map_id: str


class Twist(TypedDict):
    """
    Constant velocity of a sensor during a scan, in its own frame.
    """

    vx: float
    vy: NotRequired[float]
    omega: float


class UpdateScan(TypedDict):
    """
    A scan as ranges, and optionally the pose of it that the robot assumed, or its odometry.
    """

    laser: Laser
    sigma: NotRequired[float | None]
    twist: NotRequired[Twist | None]
    frame_id: NotRequired[str]
    stamp: NotRequired[Any]
    viewpoint: NotRequired[list[float] | None]
    pose: NotRequired[Pose | None]
    covariance: NotRequired[list[list[float]] | None]
    flipped: NotRequired[bool]
    odometry: NotRequired[Pose | None]


class VectorizeOptions(TypedDict):
    """
    How to cut points into segments.
    """

    sigma: NotRequired[float | None]
    min_points: NotRequired[int]
    min_length: NotRequired[float]
    max_gap: NotRequired[float | None]


class VectorizeRequest(TypedDict):
    """
    Ranges or points; exactly one of the two.
    """

    laser: NotRequired[Laser | None]
    points: NotRequired[list[list[float]] | None]
    twist: NotRequired[Twist | None]
    viewpoint: NotRequired[list[float] | None]
    options: NotRequired[VectorizeOptions]


class Visit(TypedDict):
    """
    Scans of one visit to the building, such as a drive or a day.
    """

    visit: str
    scans: list[UpdateScan]


class AlternativeAnswer(TypedDict):
    """
    Another pose that explains part of the scan.
    """

    pose: PoseAnswer
    covariance: list[list[float]] | None
    score: float
    ambiguity: AmbiguityAnswer
    reliability: float
    inlier_fraction: float
    probability: float | None
    map_id: NotRequired[str | None]


class AnalyzedPlaceAnswer(TypedDict):
    """
    Result at a place.
    """

    pose: PoseAnswer
    status: Literal["ok", "ambiguous", "degenerate", "no_match"]
    usable: bool
    probability: float | None
    similar_pose: PoseAnswer | None
    unobservable: list[float] | None
    reasons: list[
        Literal[
            "prior_contradicted",
            "search_incomplete",
            "not_on_map",
            "unobservable_direction",
            "similar_place",
            "single_wall",
            "map_mismatch",
            "insufficient_evidence",
        ]
    ]
    resolved_after: float | None
    with_landmark: WithLandmarkAnswer | None


class ApplyAnswer(TypedDict):
    """
    A map with the accepted changes; nothing is stored.
    """

    map: NewMapAnswer
    client_ref: Any
    request_id: str
    timing_ms: TimingAnswer


class ChangeAnswer(TypedDict):
    """
    A proposed change.
    """

    code: Literal["removed", "added", "moved", "extended", "shortened"]
    segments: list[int]
    new: list[NewSegmentAnswer]
    evidence: EvidenceAnswer
    confidence: float
    accepted: bool


class CriticalWallAnswer(TypedDict):
    """
    The wall whose removal would move the pose most, or leave it unobservable.
    """

    scan: list[int] | list[SegmentOfView]
    map: list[int]
    direction: list[float]
    displacement: float


class GridPictureAnswer(TypedDict):
    """
    The grid that a map comes from, as a picture.
    """

    png: str
    pose: PoseAnswer
    resolution: float


class MapList(TypedDict):
    """
    One page of maps, by id.
    """

    maps: list[MapSummaryAnswer]
    corrupt: list[str]
    next: str | None


class MapVerdictAnswer(TypedDict):
    """
    The best pose on one of several maps.
    """

    map_id: str
    revision: int | None
    status: Literal["ok", "ambiguous", "degenerate", "no_match"]
    score: float | None
    probability: float | None
    pose: PoseAnswer | None


class PlaceAnswer(TypedDict):
    """
    A pose at which a scan looks as at another one.
    """

    pose: PoseAnswer
    similar_pose: PoseAnswer


class RegisterAnswer(TypedDict):
    """
    The pose from known correspondences.
    """

    status: Literal["ok", "degenerate"]
    usable: bool
    pose: PoseAnswer | None
    covariance: list[list[float]] | None
    unobservable: list[float] | None
    residuals: list[Residual]
    diagnostics: RegistrationDiagnosticsAnswer
    request_id: str
    timing_ms: TimingAnswer


class ScansAnswer(TypedDict):
    """
    Scans of a log.
    """

    scans: list[Any]
    count: int
    report: ReportAnswer
    request_id: str
    timing_ms: ScansTimingAnswer


class UpdateAnswer(TypedDict):
    """
    Proposed changes of a map; nothing is stored.
    """

    map: NewMapAnswer
    based_on: MapReference
    changes: list[ChangeAnswer]
    scans: int
    usable_before: int
    usable_after: int
    held_back: HeldBackAnswer
    sharpened: SharpenedAnswer
    refused_visits: list[RefusedVisitAnswer]
    kept: list[KeptWallsAnswer]
    complete: bool
    client_ref: Any
    request_id: str
    timing_ms: TimingAnswer


class VectorizeAnswer(TypedDict):
    """
    Segments, with the fields that a scan of segments takes.
    """

    segments: list[list[float]]
    point_counts: list[int]
    centroids: list[list[float]]
    spreads: list[float]
    sigma: float
    sigmas: list[float]
    rms: list[float]
    warnings: list[WarningAnswer]
    request_id: str
    timing_ms: TimingAnswer


class AnalyzeRequest(TypedDict):
    """
    Options of an analysis of a map.
    """

    laser: NotRequired[ScannerFields]
    spacing: NotRequired[float | None]
    point: NotRequired[list[float] | None]
    drive: NotRequired[float]
    landmark: NotRequired[list[list[float]]]
    seed: NotRequired[int]
    deadline_ms: NotRequired[float | None]
    client_ref: NotRequired[Any]


class ApplyRequest(TypedDict):
    """
    A map, and changes of it that an update proposed.
    """

    map: MapDocument
    changes: list[ProposedChange]
    sharpened: NotRequired[SharpenedWalls | None]
    client_ref: NotRequired[Any]


class EstimatorOptions(TypedDict):
    """
    How to register.
    """

    estimator: NotRequired[Literal["joint", "one_step"]]
    rotation: NotRequired[Literal["wahba", "mitsuta"]]
    k_translation: NotRequired[float]
    k_rotation: NotRequired[float]
    evaluate_at: NotRequired[Pose | None]
    oriented: NotRequired[bool | None]


class LaserScan(TypedDict):
    """
    A scan as ranges.
    """

    laser: Laser
    sigma: NotRequired[float | None]
    twist: NotRequired[Twist | None]
    frame_id: NotRequired[str]
    stamp: NotRequired[Any]
    viewpoint: NotRequired[list[float] | None]


class LaserView(TypedDict):
    """
    A view as ranges.
    """

    pose: SensorPose
    flipped: NotRequired[bool]
    covariance: NotRequired[list[list[float]] | None]
    relative_to: NotRequired[int | None]
    viewpoint: NotRequired[list[float] | None]
    laser: Laser
    sigma: NotRequired[float | None]
    twist: NotRequired[Twist | None]


class MapAnalyzeRequest(TypedDict):
    """
    The same, with a map in the request.
    """

    laser: NotRequired[ScannerFields]
    spacing: NotRequired[float | None]
    point: NotRequired[list[float] | None]
    drive: NotRequired[float]
    landmark: NotRequired[list[list[float]]]
    seed: NotRequired[int]
    deadline_ms: NotRequired[float | None]
    map: InlineMap | StoredMap
    client_ref: NotRequired[Any]


class PointView(TypedDict):
    """
    A view as points in scanning order.
    """

    pose: SensorPose
    flipped: NotRequired[bool]
    covariance: NotRequired[list[list[float]] | None]
    relative_to: NotRequired[int | None]
    viewpoint: NotRequired[list[float] | None]
    points: list[list[float]]
    sigma: NotRequired[float | None]


class RegisterRequest(TypedDict):
    """
    Known correspondences.
    """

    map: KnownMap
    scan: MeasuredFields
    correspondences: NotRequired[list[list[int]] | None]
    weights: NotRequired[list[Literal[0] | float] | None]
    weighting: NotRequired[Literal["uniform", "shorter_length", "information"]]
    options: NotRequired[EstimatorOptions]


class SegmentView(TypedDict):
    """
    A view as segments.
    """

    segments: list[list[float]]
    sigma: NotRequired[float | list[float]]
    point_counts: NotRequired[list[float] | None]
    centroids: NotRequired[list[list[float]] | None]
    spreads: NotRequired[list[float] | None]
    pose: SensorPose
    flipped: NotRequired[bool]
    covariance: NotRequired[list[list[float]] | None]
    relative_to: NotRequired[int | None]
    viewpoint: NotRequired[list[float] | None]


class UpdateRequest(TypedDict):
    """
    Scans of several visits, from which changes of the map are learned.
    """

    visits: list[Visit]
    accept: NotRequired[float | None]
    refuse: NotRequired[list[int]]
    deadline_ms: NotRequired[float | None]
    client_ref: NotRequired[Any]


class ViewsScan(TypedDict):
    """
    A scan of several views: of the sensors of a robot, or from places along its way.
    """

    views: list[SegmentView | LaserView | PointView]
    frame_id: NotRequired[str]
    stamp: NotRequired[Any]


class AnalyzeAnswer(TypedDict):
    """
    Analysis of a map.
    """

    places: list[AnalyzedPlaceAnswer]
    summary: AnalysisSummaryAnswer
    spacing: float
    complete: bool
    map: MapReference | None
    client_ref: Any
    request_id: str
    timing_ms: TimingAnswer


class AssociationDiagnosticsAnswer(TypedDict):
    """
    Diagnostics of a search.
    """

    ambiguity: AmbiguityAnswer
    ambiguity_before: AmbiguityAnswer
    ambiguity_at: AmbiguityAnswer | None
    similarity: float | None
    reliability: float
    determinant: float
    chi2: float
    dof: int
    rms_offset: float
    rms_angle: float
    pairs: int
    inlier_fraction: float
    score: float
    runner_up: float | None
    margin: float | None
    critical_wall: CriticalWallAnswer | None
    corrections: CorrectionsAnswer | None
    turn_rate: float | None


class CheckAnswer(TypedDict):
    """
    Check of a map, with or without sample scans.
    """

    findings: list[FindingAnswer]
    size: SizeAnswer
    advice: AdviceAnswer
    places: list[PlaceAnswer]
    viewpoints: int
    complete: bool
    samples: SamplesAnswer | None
    map: MapReference
    client_ref: Any
    request_id: str
    timing_ms: TimingAnswer


class FoundAnswer(TypedDict):
    """
    Pose of a scan in a map, with the verdict.
    """

    status: Literal["ok", "ambiguous", "degenerate", "no_match"]
    usable: bool
    probability: float | None
    message: str
    pose: PoseAnswer | None
    covariance: list[list[float]] | None
    unobservable: list[float] | None
    frame_id: str
    child_frame_id: str
    stamp: Any
    correspondences: NotRequired[list[CorrespondenceAnswer]]
    unmatched_scan: list[int] | list[SegmentOfView]
    missing_map: NotRequired[list[int]]
    diagnostics: AssociationDiagnosticsAnswer | None
    reasons: list[ReasonAnswer]
    alternatives: NotRequired[list[AlternativeAnswer]]
    search: SearchAnswer
    segments: NotRequired[list[list[float]] | list[list[list[float]] | None] | None]
    warnings: list[WarningAnswer]
    map: NotRequired[MapReference | None]
    maps: NotRequired[list[MapVerdictAnswer]]


class MapCheckAnswer(TypedDict):
    """
    Check of a map without scans.
    """

    findings: list[FindingAnswer]
    size: SizeAnswer
    advice: AdviceAnswer
    places: list[PlaceAnswer]
    viewpoints: int
    complete: bool


class AssociateRequest(TypedDict):
    """
    Unknown correspondences.
    """

    map: NotRequired[InlineMap | StoredMap | None]
    maps: NotRequired[list[NamedMap | StoredMap] | MapPrefix | None]
    map_weights: NotRequired[dict[str, float] | None]
    scan: SegmentScan | LaserScan | PointScan | ViewsScan
    prior: NotRequired[SoftPriorFields | HardPriorFields | None]
    options: NotRequired[SearchOptions]
    client_ref: NotRequired[Any]


class BatchRequest(TypedDict):
    """
    Several scans, one map or several. Each scan and prior is checked alone, so that a bad one spoils no other.
    """

    map: NotRequired[InlineMap | StoredMap | None]
    maps: NotRequired[list[NamedMap | StoredMap] | MapPrefix | None]
    map_weights: NotRequired[dict[str, float] | None]
    scans: list[SegmentScan | LaserScan | PointScan | ViewsScan]
    priors: NotRequired[list[SoftPriorFields | HardPriorFields | None] | None]
    options: NotRequired[SearchOptions]
    client_ref: NotRequired[Any]


class CheckRequest(TypedDict):
    """
    Sample scans to check a map by, and where they were taken, as far as that is known.
    """

    scans: list[SegmentScan | LaserScan | PointScan | ViewsScan]
    poses: NotRequired[list[Pose | None] | None]
    deadline_ms: NotRequired[float | None]
    client_ref: NotRequired[Any]


class AssociateAnswer(TypedDict):
    """
    The answer of a search.
    """

    status: Literal["ok", "ambiguous", "degenerate", "no_match"]
    usable: bool
    probability: float | None
    message: str
    pose: PoseAnswer | None
    covariance: list[list[float]] | None
    unobservable: list[float] | None
    frame_id: str
    child_frame_id: str
    stamp: Any
    correspondences: NotRequired[list[CorrespondenceAnswer]]
    unmatched_scan: list[int] | list[SegmentOfView]
    missing_map: NotRequired[list[int]]
    diagnostics: AssociationDiagnosticsAnswer | None
    reasons: list[ReasonAnswer]
    alternatives: NotRequired[list[AlternativeAnswer]]
    search: SearchAnswer
    segments: NotRequired[list[list[float]] | list[list[list[float]] | None] | None]
    warnings: list[WarningAnswer]
    map: MapReference | None
    maps: NotRequired[list[MapVerdictAnswer]]
    client_ref: Any
    request_id: str
    timing_ms: TimingAnswer


class BatchResult(TypedDict):
    """
    One scan's answer, or its problem.
    """

    index: int
    status_code: int
    result: NotRequired[FoundAnswer | None]
    problem: NotRequired[Problem | None]


class ImportAnswer(TypedDict):
    """
    A map of another tool.
    """

    map: ImportedMapAnswer
    report: ReportAnswer
    picture: GridPictureAnswer | None
    check: MapCheckAnswer
    request_id: str
    timing_ms: ImportTimingAnswer


class BatchAnswer(TypedDict):
    """
    The answers in the order of the scans.
    """

    results: list[BatchResult]
    map: MapReference | None
    client_ref: Any
    request_id: str
    timing_ms: TimingAnswer
