"""Parts of all answers, and answers of a registration and a vectorization; for documentation and tests."""

from __future__ import annotations

from typing import Any, Literal

from association import WarningCode

from .strict import Answer, Index, Matrix, Milliseconds, Row2, Row4


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


class MapReference(Answer):
    """Which map was searched; of several maps that of the pose.

    Attributes
    ----------
    revision
        of a stored map; null: the map came with the request
    """

    map_id: str
    revision: int | None


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
