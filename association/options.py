"""Options of a search, priors, and the deadline."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, wrap_angle

from .errors import InvalidSearchError
from .tuning import GREATEST_ANGLE_GATE, REACH

Estimator = Literal["joint", "one_step"]
Rotation = Literal["wahba", "mitsuta"]
Sampling = Literal["ordered", "random"]
Part = Literal["correspondences", "alternatives", "missing_map"]

INCLUDED: tuple[Part, ...] = get_args(Part)

MAX_ALTERNATIVES = 50

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class SoftPrior:
    """A Gaussian over the pose: it scores, and is never fused into pose or covariance.

    Attributes
    ----------
    pose : RigidTransform
        map_from_scan.
    covariance : (3, 3)
        Of additive (x, y, theta) in the map frame; m^2, m rad, rad^2; positive definite.
    """

    pose: RigidTransform
    covariance: Floats

    def __post_init__(self) -> None:
        _check_pose(self.pose)
        c = np.asarray(self.covariance, dtype=np.float64)
        found = _fault_of_covariance(c)
        if found is not None:
            raise InvalidSearchError(
                f"expected a symmetric positive definite 3 x 3 matrix with deviations from 1e-6 to 1e6, found {found}",
                argument="prior.covariance",
            )


def _check_pose(pose: RigidTransform) -> None:
    if not isinstance(pose, RigidTransform):
        raise InvalidSearchError(f"expected a RigidTransform, found {pose!r:.60}", argument="prior.pose")


def _fault_of_covariance(c: NDArray[np.float64]) -> str | None:
    """Return what is found in place of a covariance, or None."""
    if c.shape != (3, 3):
        return f"an array of shape {c.shape}"
    if not np.isfinite(c).all():
        return "a number that is not finite"
    if not np.allclose(c, c.T, rtol=1e-6, atol=0.0):
        return "a matrix that is not symmetric"
    scale = np.sqrt(np.abs(np.diag(c)))
    if not (scale.min() >= 1e-6 and scale.max() <= 1e6):
        return f"deviations from {scale.min():.3g} to {scale.max():.3g}"
    if not np.linalg.eigvalsh(c / np.outer(scale, scale)).min() > 1e-9:
        return "a matrix that is not positive definite"
    return None


@dataclass(frozen=True, slots=True)
class HardPrior:
    """A window that the answer must lie in: `radius` metres and `angle` radians around `pose`."""

    pose: RigidTransform
    radius: float
    angle: float

    def __post_init__(self) -> None:
        _check_pose(self.pose)
        for name, value, high in (("radius", self.radius, 1e6), ("angle", self.angle, 4.0)):
            if not 0.0 < value <= high:
                raise InvalidSearchError(
                    f"expected a number above 0 and at most {high:g}, found {value:g}", argument=f"prior.{name}"
                )

    def contains(self, pose: RigidTransform) -> bool:
        """Return whether a pose lies within the window."""
        away = math.hypot(pose.x - self.pose.x, pose.y - self.pose.y)
        return away <= self.radius and abs(wrap_angle(pose.theta - self.pose.theta)) <= self.angle


Prior = SoftPrior | HardPrior


@dataclass(frozen=True, slots=True, eq=False)
class MapsPrior:
    """Prior knowledge about which of several maps the robot is on, and of its pose on one of them.

    Attributes
    ----------
    of_maps : (k,)
        Of each map, added to the posterior of each pose on it, nats; at most 0, that of the likeliest map.
    of_pose : SoftPrior, HardPrior or None
        In the joint frame of the maps.
    """

    of_maps: Floats
    of_pose: Prior | None


@dataclass(frozen=True, slots=True)
class AssociationOptions:
    """How to search.

    Attributes
    ----------
    max_alternatives : int
        Greatest number of other poses to report.
    confidence : float
        Wanted probability of not having missed a better consensus set, below 1.
    exhaustive : bool
        Go through all bases whatever the confidence.
    sampling : "ordered" or "random"
        Order in which bases are drawn: cheap and informative ones first, or at random by `seed`, weighted by that
        merit. Ordered bases stop when their own choice shows that nothing was missed. Random ones stop when as many
        draws would have hit the inliers of a better consensus set.
    seed : int
        Of random bases; ordered ones are the same whatever the seed.
    oriented : bool
        True if the directions of segments are evidence: free space lies on their left.
    offset_tolerance : float or None
        Metres; gate on the distance of a scan segment's midpoint from its map line. None: from the sigmas.
    angle_tolerance : float or None
        Radians; gate on the angle between them. None: from the sigmas.
    min_overlap : float
        Share of a scan segment's length that must lie on the map, 0 to 1.
    include : tuple of str
        Which of "correspondences", "alternatives", "missing_map" the answer is to have; the others are empty. Without
        them a usable answer has no alternatives; any other has, because `AssociationResult.message` has their number.
    on_map : float
        Prior probability that the scan was taken on this map, or on one of these: 0.5 to 1. A robot that cannot leave
        the building has 1.
    usable_from : float
        Least `AssociationResult.probability` of a usable answer, 0.5 to 0.9999.
    estimator, rotation : str
        Of the final pose, as in `registration.RegistrationOptions`; the estimator also of the returned scores.

    Raises
    ------
    InvalidSearchError
        When a value is out of range.
    """

    max_alternatives: int = 5
    confidence: float = 0.9999
    exhaustive: bool = False
    seed: int = 0
    sampling: Sampling = "ordered"
    oriented: bool = True
    offset_tolerance: float | None = None
    angle_tolerance: float | None = None
    min_overlap: float = 0.5
    include: tuple[Part, ...] = INCLUDED
    on_map: float = 0.9
    usable_from: float = 0.95
    estimator: Estimator = "joint"
    rotation: Rotation = "wahba"

    def __post_init__(self) -> None:
        ranges: list[tuple[str, float | None, float, float]] = [
            ("max_alternatives", self.max_alternatives, 0, MAX_ALTERNATIVES),
            ("confidence", self.confidence, 0.5, 1.0),
            ("seed", self.seed, 0, 2**63 - 1),
            ("offset_tolerance", self.offset_tolerance, 1e-3, REACH),
            ("angle_tolerance", self.angle_tolerance, 1e-3, GREATEST_ANGLE_GATE),
            ("min_overlap", self.min_overlap, 0.0, 1.0),
            ("on_map", self.on_map, 0.5, 1.0),
            ("usable_from", self.usable_from, 0.5, 0.9999),
        ]
        if unknown := set(self.include).difference(INCLUDED):
            raise InvalidSearchError(
                f"expected some of {', '.join(INCLUDED)}, found {sorted(unknown)}", argument="options.include"
            )
        for name, value, low, high in ranges:
            if value is not None and not low <= value <= high:
                raise InvalidSearchError(
                    f"expected a number from {low:g} to {high:g}, found {value:g}", argument=f"options.{name}"
                )
