"""Parts that answers are put together from."""

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
    """Duration of the request, milliseconds.

    Attributes
    ----------
    decode
        from the arrival of the body until the search: reading, waiting, indexing
    search
        the search, or the other computation of this request
    total
        from the arrival of the body until the answer is written
    """

    decode: Milliseconds
    search: Milliseconds
    total: Milliseconds


class SealedAnswer(Answer):
    """Fields that each answer ends with."""

    request_id: str
    timing_ms: TimingAnswer


class ReferencedAnswer(SealedAnswer):
    """The same, with the reference of the request.

    Attributes
    ----------
    client_ref
        returned as it was sent
    """

    client_ref: Any


class PoseAnswer(Answer):
    """The scan frame's pose in the map frame.

    Attributes
    ----------
    x, y
        metres
    theta
        radians, counter-clockwise, in (-pi, pi]
    """

    x: float
    y: float
    theta: float


class AmbiguityAnswer(Answer):
    """The paper's ambiguity, with the weights used.

    Attributes
    ----------
    translation
        ambiguity of the translation
    rotation
        ambiguity of the rotation
    total
        sum of both
    """

    translation: float
    rotation: float
    total: float


class Residual(Answer):
    """Residuals of one pair.

    Attributes
    ----------
    offset
        metres, signed, at the scan segment's midpoint
    angle
        radians
    weight
        weight of the pair in the estimate; 1/m^2 with information weighting
    """

    scan: Index
    map: Index
    offset: float
    angle: float
    weight: float


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


class WarningAnswer(Answer):
    """A warning about the scan, the map or the search.

    Attributes
    ----------
    code
        stable; later versions may add codes
    message
        fault and remedy, for people
    """

    code: WarningCode
    message: str


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


class MapReference(Answer):
    """Which map was searched; of several maps that of the pose.

    Attributes
    ----------
    revision
        of a stored map; null: the map came with the request
    """

    map_id: str
    revision: int | None


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
