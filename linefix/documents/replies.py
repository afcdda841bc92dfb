"""Answers of a registration and a vectorization; for the documentation, and for the tests of answers."""

from __future__ import annotations

from typing import Literal

from .reply_parts import PoseAnswer, SealedAnswer, WarningAnswer
from .strict import Answer, Index, Matrix, Row2, Row4


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
