"""Both estimators and their diagnostics, over weighted pairs.

There are two frames besides the caller's, or digits would be lost: the *local* one is the map's, about the middle of
the map segments, and the *centred* one is the scan's, about the middle of the scan segments.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from .correspondences import Correspondences, cross
from .kernels.sums import joint_cost, joint_solve
from .layout import Floats
from .observability import Free, Freedom, freedom
from .options import RegistrationOptions, Rotation
from .result import Ambiguity
from .sums import (
    COUNT,
    OneStepSums,
    determinant_and_reliability,
    information_of,
    inverse_of,
    joint_factors,
    joint_record,
    joint_terms,
)
from .transform import RigidTransform, wrap_angle
from .weights import PairWeights

MARGIN = 9.0  # of chi-square: three standard deviations
SAME_ANGLE = 1e-6  # rad; both starts have come down to one minimum
ROUNDING = 1e-12  # of the sums, what a difference of two costs may be and mean nothing


@dataclass(frozen=True, slots=True)
class Fit:
    """A transform, map_from_scan, that was fitted to pairs or given.

    Attributes
    ----------
    pose : RigidTransform
        Local from scan.
    between : RigidTransform
        Local from centred: the same rotation.
    freedom : Freedom
    covariance : (3, 3) or None
        Of additive (x, y, theta) of the pose, where it is wanted and nothing is free.
    """

    pose: RigidTransform
    between: RigidTransform
    freedom: Freedom
    covariance: Floats | None


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """Weighted pairs about the middles of both sets, those that count.

    Attributes
    ----------
    pairs : Correspondences
        Local and centred.
    weights : PairWeights
    middles : ((2,), (2,))
        Of the map segments and of the scan segments, metres in the caller's frames.
    phi, psi : (5, n), (2, n)
        Factors of the joint sums, see `joint_factors`.
    terms : (18, n)
        Terms that each pair of weight 1 adds to the joint sums.
    angle : float
        Wahba's, radians.
    unique : bool
        True if only one way to turn the segments round fits.
    """

    pairs: Correspondences
    weights: PairWeights
    middles: tuple[Floats, Floats]
    phi: Floats
    psi: Floats
    terms: Floats
    angle: float
    unique: bool

    @classmethod
    def of(cls, given: Correspondences, weights: PairWeights, *, oriented: bool) -> tuple[Problem, Correspondences]:
        """Take pairs, one of which counts at least, to the middles; return those that count, and all of them.

        Segments without a direction are turned round as one rotation wants.
        """
        counting = weights.used > 0.0
        whole = bool(counting.all())
        some, weights = (given, weights) if whole else (given.take(counting), weights.take(counting))
        middles = some.map_midpoints.mean(axis=0), some.centroids.mean(axis=0)
        every, unique = given.about(*middles), True
        if not oriented:
            theta, unique = _choose_rotation(every.take(counting), weights)
            against = np.abs(every.angles(theta)) > 0.5 * math.pi
            every = replace(every, directions=np.where(against[:, None], -every.directions, every.directions))
        pairs = every if whole else every.take(counting)
        phi, psi = joint_factors(pairs)
        angle = math.atan2(-(weights.used @ psi[0]), weights.used @ psi[1])
        return cls(pairs, weights, middles, phi, psi, joint_terms(phi, psi, pairs.spreads), angle, unique), every

    def fit(self, options: RegistrationOptions, at: RigidTransform | None = None) -> Fit:
        """Fit a transform, or take one that is given."""
        used, noise = self.weights.used, self.weights.noise
        sums = self._sums(used)
        pose, between, moves = self._transform(sums, options, at)
        of_noise = None if noise is None else sums if noise is used else self._sums(noise)
        free = freedom(self.pairs, sums, None if noise is None or of_noise is None else (noise, of_noise), pose.theta)
        if moves and free.what in (Free.DIRECTION, Free.PARALLEL):
            # Of those that fit the one receives whose translation in the caller's frames is shortest that way.
            (x, y), (map_x, map_y) = free.direction, self.middles[0].tolist()
            back = -min(free.slack, max(-free.slack, x * (map_x + pose.x) + y * (map_y + pose.y)))
            pose, between = pose.shifted(back * x, back * y), between.shifted(back * x, back * y)
        fixed = free.what is Free.NOTHING and self.unique and options.estimator == "joint"
        return Fit(pose, between, free, self._covariance(sums, pose.theta) if fixed else None)

    def _sums(self, weights: Floats) -> Floats:
        """Return the joint sums (18,) with other weights."""
        sums: Floats = self.terms @ weights
        sums[COUNT] = len(weights)
        return sums

    def _transform(
        self, sums: Floats, options: RegistrationOptions, at: RigidTransform | None
    ) -> tuple[RigidTransform, RigidTransform, bool]:
        """Return the pose, the transform between the middles, and whether a translation that is free may be moved.

        It may not where it is given, nor where the paper has an answer.
        """
        (map_x, map_y), (x, y) = self.middles[0].tolist(), self.middles[1].tolist()
        if at is not None:
            pose, observable = at.shifted(-map_x, -map_y), True
        elif options.estimator == "one_step":
            pose, observable = self._paper_transform(options.rotation)
        else:
            start = self.angle
            if options.rotation == "mitsuta":
                start += float(self.weights.used @ self.pairs.angles(start)) / float(self.weights.used.sum())
            theta, between_x, between_y, _, _ = joint_solve(joint_record(sums), start)
            between = RigidTransform(between_x, between_y, theta)
            return between.compose(RigidTransform(-x, -y, 0.0)), between, True
        return pose, pose.compose(RigidTransform(x, y, 0.0)), not observable

    def _paper_transform(self, rotation: Rotation) -> tuple[RigidTransform, bool]:
        """Return the paper's transform, local from scan, and whether the lines fix its translation.

        It is fitted in the caller's scan frame, on whose origin the translation depends. Moving the map's origin moves
        it along and no more. A second pass about the first answer takes out what the first lost to rounding.
        """
        local = self.pairs.about((0.0, 0.0), -self.middles[1])
        pose, observable = RigidTransform(0.0, 0.0, self.angle), False
        for _ in range(2):
            reference = RigidTransform(pose.x, pose.y, self.angle)
            pose, observable = OneStepSums.of_set(local, self.weights.used, reference).solve(rotation)
        return pose, observable

    def _covariance(self, sums: Floats, theta: float) -> Floats:
        """Return the covariance of additive (x, y, theta) of the scan in the map frame.

        The inverse of the information matrix ``F`` when the weights are the information; else, for pairs weighted ``w``
        of information ``i``, ``F(w)^-1 F(w^2 / i) F(w)^-1``.
        """
        used, information = self.weights.used, self.weights.information
        covariance = inverse_of(information_of(sums, theta))
        if information is not used:
            covariance = covariance @ information_of(self._sums(used * used / information), theta) @ covariance
        # From the middle of the scan segments to the origin of the scan frame.
        x, y = self.middles[1].tolist()
        return RigidTransform(0.0, 0.0, theta).carry(covariance, RigidTransform(-x, -y, 0.0))

    def ambiguities(self, at: list[RigidTransform], options: RegistrationOptions) -> list[Ambiguity]:
        """Return the paper's ambiguity at transforms, local from scan."""
        used, pairs = self.weights.used, self.pairs
        angles, (nx, ny) = pairs.angles(self.angle), self.phi[2:4]
        # Eq. (1) for T = 0 in the caller's scan frame.
        gaps = pairs.map_offsets - cross(pairs.directions, pairs.midpoints + self.middles[1])
        found = []
        for pose in at:
            gap, turned = gaps - pose.x * nx - pose.y * ny, angles - wrap_angle(pose.theta - self.angle)
            error = turned if options.rotation == "mitsuta" else 2.0 * np.sin(0.5 * turned)
            translation, rotation = float(used @ (gap * gap)), float(used @ (error * error))
            found.append(Ambiguity(options.k_translation * translation, options.k_rotation * rotation))
        return found

    def determinant_and_reliability(self) -> tuple[float, float]:
        """Return Eq. (8)'s D and Eq. (28)."""
        w, (nx, ny) = self.weights.used, self.phi[2:4]
        weighted = w * nx
        xx, xy, yy = float(weighted @ nx), float(weighted @ ny), float((w * ny) @ ny)
        return determinant_and_reliability(float(w.sum()), yy, xx, -xy)

    def chi_square(self, between: RigidTransform) -> float:
        """Return the joint cost, by the information."""
        x = np.array([math.cos(between.theta), math.sin(between.theta), between.x, between.y, 1.0])
        distance, across = x @ self.phi, x[:2] @ self.psi
        return float(self.weights.information @ (distance * distance + self.pairs.spreads * across * across))


def _choose_rotation(pairs: Correspondences, weights: PairWeights) -> tuple[float, bool]:
    """Find the rotation of pairs whose scan segments may each run either way.

    Twice an angle does not change when a segment is turned round, so the mean of the doubled angles gives the rotation
    but for a half turn. Both are solved, and the lower joint cost wins; the cost itself does not see directions.

    Returns
    -------
    theta : float
        Radians; a scan segment that runs against its map segment after it is to be turned round.
    unique : bool
        False when the half turn fits about as well: not worse by three standard deviations or, without noise, by
        rounding. Of two that fit equally well the smaller rotation is taken.
    """
    judged, doubled = weights.used if weights.noise is None else weights.noise, 2.0 * pairs.angles(0.0)
    start = 0.5 * math.atan2(judged @ np.sin(doubled), judged @ np.cos(doubled))
    sums = joint_record(joint_terms(*joint_factors(pairs), pairs.spreads) @ judged)
    (one, cost), (other, other_cost) = (
        (theta, joint_cost(sums, theta, x, y))
        for theta, x, y, _, _ in (joint_solve(sums, start + turn) for turn in (0.0, math.pi))
    )
    rounding = ROUNDING * float(sums["cc"] + sums["ss"])
    only_one = abs(math.sin(0.5 * (other - one))) < 0.5 * SAME_ANGLE
    unique = only_one or abs(other_cost - cost) > rounding + (0.0 if weights.noise is None else MARGIN)
    return (one if cost <= other_cost + rounding else other), unique
