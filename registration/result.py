"""The result of a registration."""

from __future__ import annotations

from dataclasses import dataclass

from .layout import Floats
from .transform import RigidTransform


@dataclass(frozen=True, slots=True)
class Ambiguity:
    """The paper's ambiguity, its translation and rotation parts and their sum (Eqs. 17 to 20)."""

    translation: float
    rotation: float

    @property
    def total(self) -> float:
        """Eq. (20)."""
        return self.translation + self.rotation


@dataclass(frozen=True, slots=True)
class RegistrationDiagnostics:
    """Diagnostics of the pose, with the weights that were used.

    Attributes
    ----------
    ambiguity, ambiguity_before : Ambiguity
        At the answered pose and at T = 0.
    ambiguity_at : Ambiguity or None
        At the transform that the caller asked for.
    similarity : float or None
        1 / total ambiguity; None where that is 0.
    reliability : float
        Eq. (28), 0 to 1.
    determinant : float
        Eq. (8)'s D.
    chi2 : float
        Joint cost at the answered pose, weighted with the caller's weights, or else with 1 / variance by the sigmas;
        where those are all 0, with the weights used.
    dof : int
        2 n - 3, or 2 n - 2 when all lines are parallel.
    rms_offset, rms_angle : float
        Root mean squares over those n pairs of the offsets, metres, and angles, radians.
    pairs : int
        Number of pairs with a weight over 0.
    """

    ambiguity: Ambiguity
    ambiguity_before: Ambiguity
    ambiguity_at: Ambiguity | None
    similarity: float | None
    reliability: float
    determinant: float
    chi2: float
    dof: int
    rms_offset: float
    rms_angle: float
    pairs: int


@dataclass(frozen=True, slots=True)
class RegistrationResult:
    """The answer of `register`.

    Attributes
    ----------
    degenerate : bool
        No unique transform fits: all pairs are parallel to rounding or to three standard deviations, or leave the
        translation in some direction a standard deviation over 0.5 m; or the segments have no directions and the half
        turn fits as well; or there is no pair.
    usable : bool
        Not degenerate, chi2 below its 99.9 % quantile, and no pair of opposite directions where they mean something.
    pose : RigidTransform or None
        map_from_scan; when degenerate, of those that fit the one that moves least along the free direction; None
        without pairs.
    covariance : (3, 3) or None
        Of additive (x, y, theta) in the map frame; m^2, m rad, rad^2; None when degenerate and for the one-step
        estimator.
    unobservable : (float, float) or None
        Unit vector in the map frame along which the translation is free, pointing right (or straight up); None when it
        is fixed, also when it is the half turn that is not.
    offsets : (n,)
        ``n_map . (R m_scan + t) - p_map`` at the midpoints, metres.
    angles : (n,)
        ``wrap(angle(d_map) - angle(d_scan) - theta)``, radians; where directions mean nothing, of the scan segment
        turned to run along the map's.
    weights : (n,)
        As used by the estimator and the ambiguities.
    diagnostics : RegistrationDiagnostics
    """

    degenerate: bool
    usable: bool
    pose: RigidTransform | None
    covariance: Floats | None
    unobservable: tuple[float, float] | None
    offsets: Floats
    angles: Floats
    weights: Floats
    diagnostics: RegistrationDiagnostics
