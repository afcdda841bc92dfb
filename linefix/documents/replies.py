"""Answers of the routes; for the documentation, and for the tests that check the answers against them."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from .reply_parts import (
    AlternativeAnswer,
    AmbiguityAnswer,
    CorrectionsAnswer,
    CorrespondenceAnswer,
    CriticalWallAnswer,
    Index,
    MapReference,
    MapVerdictAnswer,
    Matrix,
    PoseAnswer,
    ReasonAnswer,
    ReferencedAnswer,
    Residual,
    Row2,
    Row4,
    SealedAnswer,
    SearchAnswer,
    SegmentOfView,
    Share,
    Verdict,
    WarningAnswer,
)
from .strict import Answer


class RegistrationDiagnosticsAnswer(Answer):
    """Diagnostics of a registration.

    Attributes
    ----------
    ambiguity
        ambiguity at the returned pose
    ambiguity_before
        ambiguity at the pose 0, 0, 0
    ambiguity_at
        ambiguity at the pose `evaluate_at`
    similarity
        1 / total ambiguity; null where that is 0
    reliability
        0 to 1: how well the directions fix the translation; scale-free
    determinant
        D of equation 8 of the paper
    chi2
        joint cost at the answered pose
    dof
        degrees of freedom of `chi2`
    rms_offset
        metres
    rms_angle
        radians
    pairs
        number of pairs
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
    pairs: Index


class RegisterAnswer(SealedAnswer):
    """The pose from known correspondences.

    Attributes
    ----------
    usable
        ok, and chi2 below its 99.9 % quantile
    covariance
        covariance of additive (x, y, theta) in the map frame; m^2, m rad, rad^2
    unobservable
        unit vector in the map frame along which the position is unobservable
    """

    status: Literal["ok", "degenerate"]
    usable: bool
    pose: PoseAnswer | None
    covariance: Matrix | None
    unobservable: Row2 | None
    residuals: list[Residual]
    diagnostics: RegistrationDiagnosticsAnswer


class AssociationDiagnosticsAnswer(RegistrationDiagnosticsAnswer):
    """Diagnostics of a search.

    Attributes
    ----------
    inlier_fraction
        fraction of the scan's length that is matched
    score
        log-likelihood minus that of a scan of clutter alone, nats
    runner_up
        best other score as a fraction of `score`; null: none above `search.complete_above`
    margin
        `score` minus that of the best other pose, nats; null: no other pose above `search.complete_above` of `score`
    critical_wall
        the wall whose removal would move the pose most, or make it unobservable
    corrections
        errors of the map or the ranges that the pose is corrected for; null: none
    turn_rate
        rate at which the sensor turned during the scan, estimated from the walls, rad/s; null: `twist` was sent, or the
        walls show no rotation
    """

    inlier_fraction: float
    score: float
    runner_up: float | None
    margin: float | None
    critical_wall: CriticalWallAnswer | None
    corrections: CorrectionsAnswer | None
    turn_rate: float | None


class FoundAnswer(Answer):
    """Pose of a scan in a map, with the verdict.

    Attributes
    ----------
    usable
        whether a robot may use the pose
    probability
        calibrated probability that the pose is right, with the prior `options.on_map`; 0 for `no_match`, null for
        `degenerate`, whose position is unobservable along `unobservable`
    message
        the verdict in words, for people
    covariance
        covariance of additive (x, y, theta) in the map frame; m^2, m rad, rad^2
    unobservable
        unit vector in the map frame along which the position is not fixed
    frame_id
        the map's
    child_frame_id
        the scan's
    stamp
        returned as it was sent
    correspondences
        correspondences, if they are included
    unmatched_scan
        scan segments without a match; of several views with the view
    missing_map
        if included: map segments that the scan should contain, but does not
    reasons
        why it is not usable, the most important first
    alternatives
        if included: other distinct poses, best first
    segments
        where included, for a scan of ranges or points: its segments; of several views one list each, in their common
        frame
    map
        of several maps that of the pose; null for `no_match`
    maps
        of several maps the best pose on each, the best first
    """

    status: Verdict
    usable: bool
    probability: Share | None
    message: str
    pose: PoseAnswer | None
    covariance: Matrix | None
    unobservable: Row2 | None
    frame_id: str
    child_frame_id: str
    stamp: Any
    correspondences: list[CorrespondenceAnswer] = Field([])
    unmatched_scan: list[Index] | list[SegmentOfView]
    missing_map: list[Index] = Field([])
    diagnostics: AssociationDiagnosticsAnswer | None
    reasons: list[ReasonAnswer]
    alternatives: list[AlternativeAnswer] = Field([])
    search: SearchAnswer
    segments: list[Row4] | list[list[Row4] | None] | None = None
    warnings: list[WarningAnswer]
    map: MapReference | None = None
    maps: list[MapVerdictAnswer] = Field([])


class AssociateAnswer(FoundAnswer, ReferencedAnswer):
    """The answer of a search.

    Attributes
    ----------
    map
        the stored map; of several maps that of the pose; null for `no_match` there, and where a single map came with
        the request
    """

    map: MapReference | None


class VectorizeAnswer(SealedAnswer):
    """Segments, with the fields that a scan of segments takes.

    Attributes
    ----------
    segments
        `[x1, y1, x2, y2]`, metres, free space on the left
    point_counts
        points behind each
    centroids
        mean of those points, metres
    spreads
        second moment of those points along the segment, m^2
    sigma
        standard deviation of single ranges or points, metres; as sent, or estimated
    sigmas
        standard deviation of each segment's points normal to the wall, metres; `sigma` of a scan
    rms
        root mean square of the points' distances from their segment, metres
    warnings
        `points_not_in_order`, `motion_unknown`, as of /v1/associate
    """

    segments: list[Row4]
    point_counts: list[int]
    centroids: list[Row2]
    spreads: list[float]
    sigma: float
    sigmas: list[float]
    rms: list[float]
    warnings: list[WarningAnswer]
