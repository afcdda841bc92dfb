"""The answer of a search, and its parts; for the documentation, and for the tests of answers."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from association import ReasonCode

from .replies import (
    AmbiguityAnswer,
    MapReference,
    PoseAnswer,
    ReferencedAnswer,
    RegistrationDiagnosticsAnswer,
    Residual,
    WarningAnswer,
)
from .strict import Answer, Index, Matrix, Row2, Row3, Row4, Share, Verdict


class SegmentOfView(Answer):
    """A segment of a scan of several views.

    Attributes
    ----------
    scan
        index of the segment in the view
    """

    view: Index
    scan: Index


class CorrespondenceAnswer(Residual):
    """A scan segment found on a map segment.

    Attributes
    ----------
    view
        index of the view, for a scan of several views; `scan` is then an index in this view
    overlap
        fraction of the scan segment's length that lies on the map
    alternatives
        other map segments that pass the gates
    """

    view: Index | None = None
    overlap: Share
    alternatives: list[Index]


class AlternativeAnswer(Answer):
    """Another pose that explains part of the scan.

    Attributes
    ----------
    covariance
        covariance of this pose, as `covariance` of the answer; null if the pose is degenerate
    score
        score of this pose, as `diagnostics.score`, nats
    reliability
        reliability of this pose, as `diagnostics.reliability`
    inlier_fraction
        fraction of the scan's length that is matched
    probability
        that this pose is right, as `probability` of the answer; null where the answer has no probability, or
        contradicts the prior
    map_id
        of several maps the one that the pose is on
    """

    pose: PoseAnswer
    covariance: Matrix | None
    score: float
    ambiguity: AmbiguityAnswer
    reliability: float
    inlier_fraction: float
    probability: float | None
    map_id: str | None = None


class CriticalWallAnswer(Answer):
    """The wall whose removal would move the pose most, or leave it unobservable.

    Attributes
    ----------
    scan
        scan segments on the wall
    map
        map segments of the wall
    direction
        unit vector in the map frame
    displacement
        metres by which the pose would move, or the standard deviation where that is more
    """

    scan: list[Index] | list[SegmentOfView]
    map: list[Index]
    direction: Row2
    displacement: float


class CorrectionsAnswer(Answer):
    """Errors of the map around the sensor, or of the ranges, that were estimated together with the pose.

    Attributes
    ----------
    scale
        factor on the lengths of the scan; 1: none
    offset
        metres by which all walls are nearer to the sensor than on the map
    strain
        elongation of the map along its x and y axis, and half of the shear, as fractions: xx, yy, xy
    """

    scale: float
    offset: float
    strain: Row3


class SearchAnswer(Answer):
    """Statistics of the search.

    Attributes
    ----------
    complete
        false when deadline or budget ended it early
    exhaustive
        whether every pair of segments was tried; true only for a complete search
    confidence
        probability that the search missed no better pose
    bases
        bases that were tried
    hypotheses
        poses that the bases proposed
    verified
        poses that were scored completely
    seed, sampling
        value of the option
    complete_above
        no pose above this fraction of the best score was missed, if its correspondences agree within their tolerances;
        1 for an incomplete search
    """

    complete: bool
    exhaustive: bool
    confidence: float
    bases: Index
    hypotheses: Index
    verified: Index
    seed: int
    sampling: Literal["ordered", "random"]
    complete_above: float


class ReasonAnswer(Answer):
    """Why an answer is not usable.

    Attributes
    ----------
    code
        stable; later versions may add codes
    message
        the reason and what to do, for people
    """

    code: ReasonCode
    message: str


class MapVerdictAnswer(MapReference):
    """The best pose on one of several maps.

    Attributes
    ----------
    status
        of the map of the answer its status; of another map `ambiguous` where its pose explains the scan about as well
        and the answer is not usable, else `no_match`
    score
        score of the best pose on this map, with the logarithm of its weight, nats; null: none was found
    probability
        probability that this pose is right; null where the answer has none
    pose
        in the frame of this map
    """

    status: Verdict
    score: float | None
    probability: Share | None
    pose: PoseAnswer | None


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
