"""Answers of the routes; for the documentation, and for the tests that check the answers against them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from association import ReasonCode, WarningCode

from .strict import Answer

Row4 = Annotated[list[float], Field(min_length=4, max_length=4)]
Row3 = Annotated[list[float], Field(min_length=3, max_length=3)]
Row2 = Annotated[list[float], Field(min_length=2, max_length=2)]
Matrix = Annotated[list[Row3], Field(min_length=3, max_length=3)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]
Index = Annotated[int, Field(ge=0)]
Milliseconds = Annotated[float, Field(ge=0.0)]
Verdict = Literal["ok", "ambiguous", "degenerate", "no_match"]


class TimingAnswer(Answer):
    """Duration of the request, milliseconds."""

    decode: Milliseconds = Field(
        description="from the arrival of the body until the search: reading, waiting, indexing"
    )
    search: Milliseconds = Field(description="the search, or the other computation of this request")
    total: Milliseconds = Field(description="from the arrival of the body until the answer is written")


class PoseAnswer(Answer):
    """The scan frame's pose in the map frame."""

    x: float = Field(description="metres")
    y: float = Field(description="metres")
    theta: float = Field(description="radians, counter-clockwise, in (-pi, pi]")


class AmbiguityAnswer(Answer):
    """The paper's ambiguity, with the weights used."""

    translation: float = Field(description="ambiguity of the translation")
    rotation: float = Field(description="ambiguity of the rotation")
    total: float = Field(description="sum of both")


class RegistrationDiagnosticsAnswer(Answer):
    """Diagnostics of a registration."""

    ambiguity: AmbiguityAnswer = Field(description="ambiguity at the returned pose")
    ambiguity_before: AmbiguityAnswer = Field(description="ambiguity at the pose 0, 0, 0")
    ambiguity_at: AmbiguityAnswer | None = Field(description="ambiguity at the pose `evaluate_at`")
    similarity: float | None = Field(description="1 / total ambiguity; null where that is 0")
    reliability: float = Field(description="0 to 1: how well the directions fix the translation; scale-free")
    determinant: float = Field(description="D of equation 8 of the paper")
    chi2: float = Field(description="joint cost at the answered pose")
    dof: int = Field(description="degrees of freedom of `chi2`")
    rms_offset: float = Field(description="metres")
    rms_angle: float = Field(description="radians")
    pairs: Index = Field(description="number of pairs")


class Residual(Answer):
    """Residuals of one pair."""

    scan: Index
    map: Index
    offset: float = Field(description="metres, signed, at the scan segment's midpoint")
    angle: float = Field(description="radians")
    weight: float = Field(description="weight of the pair in the estimate; 1/m^2 with information weighting")


class RegisterAnswer(Answer):
    """The pose from known correspondences."""

    status: Literal["ok", "degenerate"]
    usable: bool = Field(description="ok, and chi2 below its 99.9 % quantile")
    pose: PoseAnswer | None
    covariance: Matrix | None = Field(
        description="covariance of additive (x, y, theta) in the map frame; m^2, m rad, rad^2"
    )
    unobservable: Row2 | None = Field(
        description="unit vector in the map frame along which the position is unobservable"
    )
    residuals: list[Residual]
    diagnostics: RegistrationDiagnosticsAnswer
    request_id: str
    timing_ms: TimingAnswer


class SegmentOfView(Answer):
    """A segment of a scan of several views."""

    view: Index
    scan: Index = Field(description="index of the segment in the view")


class CorrespondenceAnswer(Residual):
    """A scan segment found on a map segment."""

    view: Index | None = Field(
        None, description="index of the view, for a scan of several views; `scan` is then an index in this view"
    )
    overlap: Share = Field(description="fraction of the scan segment's length that lies on the map")
    alternatives: list[Index] = Field(description="other map segments that pass the gates")


class AlternativeAnswer(Answer):
    """Another pose that explains part of the scan."""

    pose: PoseAnswer
    covariance: Matrix | None = Field(
        description="covariance of this pose, as `covariance` of the answer; null if the pose is degenerate"
    )
    score: float = Field(description="score of this pose, as `diagnostics.score`, nats")
    ambiguity: AmbiguityAnswer
    reliability: float = Field(description="reliability of this pose, as `diagnostics.reliability`")
    inlier_fraction: float = Field(description="fraction of the scan's length that is matched")
    probability: float | None = Field(
        description="that this pose is right, as `probability` of the answer; null where the answer has no "
        "probability, or contradicts the prior"
    )
    map_id: str | None = Field(None, description="of several maps the one that the pose is on")


class CriticalWallAnswer(Answer):
    """The wall whose removal would move the pose most, or leave it unobservable."""

    scan: list[Index] | list[SegmentOfView] = Field(description="scan segments on the wall")
    map: list[Index] = Field(description="map segments of the wall")
    direction: Row2 = Field(description="unit vector in the map frame")
    displacement: float = Field(
        description="metres by which the pose would move, or the standard deviation where that is more"
    )


class CorrectionsAnswer(Answer):
    """Errors of the map around the sensor, or of the ranges, that were estimated together with the pose."""

    scale: float = Field(description="factor on the lengths of the scan; 1: none")
    offset: float = Field(description="metres by which all walls are nearer to the sensor than on the map")
    strain: Row3 = Field(
        description="elongation of the map along its x and y axis, and half of the shear, as fractions: xx, yy, xy"
    )


class AssociationDiagnosticsAnswer(RegistrationDiagnosticsAnswer):
    """Diagnostics of a search."""

    inlier_fraction: float = Field(description="fraction of the scan's length that is matched")
    score: float = Field(description="log-likelihood minus that of a scan of clutter alone, nats")
    runner_up: float | None = Field(
        description="best other score as a fraction of `score`; null: none above `search.complete_above`"
    )
    margin: float | None = Field(
        description="`score` minus that of the best other pose, nats; null: no other pose above "
        "`search.complete_above` of `score`"
    )
    critical_wall: CriticalWallAnswer | None = Field(
        description="the wall whose removal would move the pose most, or make it unobservable"
    )
    corrections: CorrectionsAnswer | None = Field(
        description="errors of the map or the ranges that the pose is corrected for; null: none"
    )
    turn_rate: float | None = Field(
        description="rate at which the sensor turned during the scan, estimated from the walls, rad/s; null: `twist` "
        "was sent, or the walls show no rotation"
    )


class SearchAnswer(Answer):
    """Statistics of the search."""

    complete: bool = Field(description="false when deadline or budget ended it early")
    exhaustive: bool = Field(description="whether every pair of segments was tried; true only for a complete search")
    confidence: float = Field(description="probability that the search missed no better pose")
    bases: Index = Field(description="bases that were tried")
    hypotheses: Index = Field(description="poses that the bases proposed")
    verified: Index = Field(description="poses that were scored completely")
    seed: int = Field(description="value of the option")
    sampling: Literal["ordered", "random"] = Field(description="value of the option")
    complete_above: float = Field(
        description="no pose above this fraction of the best score was missed, if its correspondences agree within "
        "their tolerances; 1 for an incomplete search"
    )


class WarningAnswer(Answer):
    """A warning about the scan, the map or the search."""

    code: WarningCode = Field(description="stable; later versions may add codes")
    message: str = Field(description="fault and remedy, for people")


class ReasonAnswer(Answer):
    """Why an answer is not usable."""

    code: ReasonCode = Field(description="stable; later versions may add codes")
    message: str = Field(description="the reason and what to do, for people")


class MapReference(Answer):
    """Which map was searched; of several maps that of the pose."""

    map_id: str
    revision: int | None = Field(description="of a stored map; null: the map came with the request")


class MapVerdictAnswer(MapReference):
    """The best pose on one of several maps."""

    status: Verdict = Field(
        description="of the map of the answer its status; of another map `ambiguous` where its pose explains the scan "
        "about as well and the answer is not usable, else `no_match`"
    )
    score: float | None = Field(
        description="score of the best pose on this map, with the logarithm of its weight, nats; null: none was found"
    )
    probability: Share | None = Field(description="probability that this pose is right; null where the answer has none")
    pose: PoseAnswer | None = Field(description="in the frame of this map")


class FoundAnswer(Answer):
    """Pose of a scan in a map, with the verdict."""

    status: Verdict
    usable: bool = Field(description="whether a robot may use the pose")
    probability: Share | None = Field(
        description="calibrated probability that the pose is right, with the prior `options.on_map`; 0 for "
        "`no_match`, null for `degenerate`, whose position is unobservable along `unobservable`"
    )
    message: str = Field(description="the verdict in words, for people")
    pose: PoseAnswer | None
    covariance: Matrix | None = Field(
        description="covariance of additive (x, y, theta) in the map frame; m^2, m rad, rad^2"
    )
    unobservable: Row2 | None = Field(description="unit vector in the map frame along which the position is not fixed")
    frame_id: str = Field(description="the map's")
    child_frame_id: str = Field(description="the scan's")
    stamp: Any = Field(description="returned as it was sent")
    correspondences: list[CorrespondenceAnswer] = Field([], description="correspondences, if they are included")
    unmatched_scan: list[Index] | list[SegmentOfView] = Field(
        description="scan segments without a match; of several views with the view"
    )
    missing_map: list[Index] = Field(
        [], description="if included: map segments that the scan should contain, but does not"
    )
    diagnostics: AssociationDiagnosticsAnswer | None
    reasons: list[ReasonAnswer] = Field(description="why it is not usable, the most important first")
    alternatives: list[AlternativeAnswer] = Field([], description="if included: other distinct poses, best first")
    search: SearchAnswer
    segments: list[Row4] | list[list[Row4] | None] | None = Field(
        None,
        description="where included, for a scan of ranges or points: its segments; of several views one list each, "
        "in their common frame",
    )
    warnings: list[WarningAnswer]
    map: MapReference | None = Field(None, description="of several maps that of the pose; null for `no_match`")
    maps: list[MapVerdictAnswer] = Field([], description="of several maps the best pose on each, the best first")


class AssociateAnswer(FoundAnswer):
    """The answer of a search."""

    map: MapReference | None = Field(
        description="the stored map; of several maps that of the pose; null for `no_match` there, and where a single "
        "map came with the request"
    )
    client_ref: Any = Field(description="returned as it was sent")
    request_id: str
    timing_ms: TimingAnswer


class VectorizeAnswer(Answer):
    """Segments, with the fields that a scan of segments takes."""

    segments: list[Row4] = Field(description="`[x1, y1, x2, y2]`, metres, free space on the left")
    point_counts: list[int] = Field(description="points behind each")
    centroids: list[Row2] = Field(description="mean of those points, metres")
    spreads: list[float] = Field(description="second moment of those points along the segment, m^2")
    sigma: float = Field(description="standard deviation of single ranges or points, metres; as sent, or estimated")
    sigmas: list[float] = Field(
        description="standard deviation of each segment's points normal to the wall, metres; `sigma` of a scan"
    )
    rms: list[float] = Field(description="root mean square of the points' distances from their segment, metres")
    warnings: list[WarningAnswer] = Field(description="`points_not_in_order`, `motion_unknown`, as of /v1/associate")
    request_id: str
    timing_ms: TimingAnswer
