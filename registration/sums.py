"""Additive sums over pairs: those of the joint estimator, and those of the paper's.

All are compensated (double-double): an array of values and their errors. After any additions and removals they are the
sums of what remains; what is lost is 2^-104 of the largest number that ever stood there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from .correspondences import Correspondences, cross
from .kernels.sums import PARALLEL_RATIO, joint_cost, joint_information, joint_solve
from .layout import JOINT_SUMS, SYMMETRIC3, Floats, Record, record
from .options import Rotation
from .transform import IDENTITY, RigidTransform, wrap_angle

BLOCK = 4096  # rows that are added at a time

UPPER = np.triu_indices(5)  # of Q, in the order of `JOINT_SUMS`
TRANSLATION = [9, 10, 12]  # columns of `JOINT_SUMS`: xx, xy, yy
FULL = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])  # where the elements of a matrix stand in `SYMMETRIC3`
CC, CS, SS, WAHBA_COS, WAHBA_SIN, COUNT = 0, 1, 5, 15, 16, 17  # columns of `JOINT_SUMS`
GAP2, ANGLE2, VERSINE, SINE = 6, 8, 9, 10  # columns of `ONE_STEP_SUMS`


@dataclass(frozen=True, slots=True, eq=False)
class CompensatedSums:
    """Sums over pairs that are added and subtracted without a loss of precision.

    Attributes
    ----------
    compensated : (2, k)
        Values and their errors, read-only.
    """

    compensated: Floats

    def __post_init__(self) -> None:
        self.compensated.setflags(write=False)

    def __add__(self, other: Self) -> Self:
        return self._combined(other, 1.0)

    def __sub__(self, other: Self) -> Self:
        return self._combined(other, -1.0)

    def _combined(self, other: Self, sign: float) -> Self:
        return replace(self, compensated=_accumulated(self.compensated, sign * other.compensated))

    def add(self, pairs: Correspondences, index: int, weight: float) -> Self:
        """Return the sums with one pair more."""
        return self + self._alone(pairs, index, weight)

    def remove(self, pairs: Correspondences, index: int, weight: float) -> Self:
        """Return the sums with one pair less; `weight` is the one that it was added with."""
        return self - self._alone(pairs, index, weight)

    def _alone(self, pairs: Correspondences, index: int, weight: float) -> Self:
        """Return the sums of one pair."""
        raise NotImplementedError

    @property
    def values(self) -> Floats:
        """The sums in plain doubles, in the order of the record's fields, (k,)."""
        values: Floats = self.compensated[0]
        return values

    @property
    def count(self) -> int:
        """Number of pairs."""
        return round(float(self.values[-1]))


def _accumulated(sums: Floats, more: Floats) -> Floats:
    """Add compensated sums, values and errors along the first axis."""
    (value, error), (high, low) = sums, more
    total = value + high
    back = total - value
    lost = (value - (total - back)) + (high - back) + (error + low)
    result = total + lost
    return np.stack([result, lost - (result - total)])


def _summed(terms: Floats, weights: ArrayLike) -> Floats:
    """Return the compensated sums (2, k) of weighted terms (k, n), whose last row counts the pairs of some weight."""
    checked = np.asarray(weights, dtype=np.float64)
    weighted = terms * checked
    weighted[-1] = checked > 0.0
    total = np.zeros((2, len(terms)))
    for begin in range(0, len(checked), BLOCK):
        block = weighted[:, begin : begin + BLOCK]
        sums = np.stack([block, np.zeros_like(block)])
        while (half := sums.shape[2] // 2) > 0:
            folded = _accumulated(sums[..., :half], sums[..., half : 2 * half])
            sums = np.concatenate([folded, sums[..., 2 * half :]], axis=2)
        total = _accumulated(total, sums[..., 0])
    return total


# Joint estimator -----------------------------------------------------------------------------------------------------


def joint_factors(pairs: Correspondences) -> tuple[Floats, Floats]:
    """Return of each pair ``[n . m, n . J m, n_x, n_y, -p]``, (5, n), and ``[n . d, n . J d]``, (2, n)."""
    ny, nx = np.ascontiguousarray(pairs.map_directions.T)
    nx = -nx
    (mx, my), (dx, dy) = pairs.centroids.T, pairs.directions.T
    phi = np.stack([nx * mx + ny * my, ny * mx - nx * my, nx, ny, -pairs.map_offsets])
    return phi, np.stack([nx * dx + ny * dy, ny * dx - nx * dy])


def joint_terms(phi: Floats, psi: Floats, spreads: Floats) -> Floats:
    """Return what each pair of weight 1 adds to the joint sums, (18, n), from its factors."""
    terms = np.empty((COUNT + 1, len(spreads)))
    np.multiply(phi[UPPER[0]], phi[UPPER[1]], out=terms[:WAHBA_COS])
    across, along = spreads * psi
    terms[CC] += across * psi[0]
    terms[CS] += across * psi[1]
    terms[SS] += along * psi[1]
    terms[WAHBA_COS], terms[WAHBA_SIN], terms[COUNT] = along, -across, 1.0
    return terms


def joint_record(values: Floats) -> Record:
    """Return joint sums (18,) as kernels take them."""
    return np.ascontiguousarray(values).view(JOINT_SUMS)[0]


def information_of(values: Floats, theta: float) -> Floats:
    """Return the information of additive (x, y, theta) in the map frame from joint sums (18,), (3, 3)."""
    out = record(SYMMETRIC3)
    joint_information(joint_record(values), theta, out[0])
    full: Floats = out.view(np.float64)[FULL]
    return full


def inverse_of(information: Floats) -> Floats:
    """Return the inverse of a positive definite matrix, scaled to a unit diagonal, as its units are unlike."""
    scale = 1.0 / np.sqrt(np.diag(information))
    units = np.outer(scale, scale)
    inverse: Floats = np.linalg.inv(information * units) * units
    return inverse


@dataclass(frozen=True, slots=True, eq=False)
class JointSums(CompensatedSums):
    """All that the joint estimator needs of a set of pairs; adding or removing takes constant time whatever its size.

    For a pair, with the map line's normal ``n`` and offset ``p`` and the scan segment's centroid ``m``, direction ``d``
    and spread ``s``, the cost is ``w ((n . (R m + t) - p)^2 + s (n . R d)^2)``: for points that a segment was fitted to
    by least squares it is, to first order, the sum of their squared distances from the map line. Over a set it is
    ``x' Q x`` with ``x = [cos, sin, t_x, t_y, 1]``; the sums are the upper triangle of ``Q``, two sums of Wahba's angle
    (Eq. 15, weighted ``w s``), and the number of pairs.

    A solution is as good as ``Q`` in plain doubles, so keep the coordinates near the origin
    (`Correspondences.about`).

    Attributes
    ----------
    compensated : (2, 18)
        Values of `JOINT_SUMS` and their errors, read-only.
    """

    @classmethod
    def of_set(cls, pairs: Correspondences, weights: ArrayLike) -> JointSums:
        """Sum over all pairs, `weights` (n,) in 1/m^2; those of weight 0 do not count."""
        return cls(_summed(joint_terms(*joint_factors(pairs), pairs.spreads), weights))

    @classmethod
    def of_pair(cls, pairs: Correspondences, index: int, weight: float) -> JointSums:
        """Sum over pair `index` alone, in constant time."""
        return cls.of_set(pairs.take(slice(index, index + 1)), [weight])

    def _alone(self, pairs: Correspondences, index: int, weight: float) -> JointSums:
        return self.of_pair(pairs, index, weight)

    def solve(self, start: float) -> tuple[float, Floats, bool]:
        """Minimise the cost.

        Parameters
        ----------
        start : float
            Radians. `Q` cannot tell a direction from its opposite: the minimum near this angle is taken.

        Returns
        -------
        theta : float
            Radians in (-pi, pi].
        translation : (2,) metres
            If all lines are parallel, the shortest.
        observable : bool
            False where all lines are parallel to rounding.
        """
        theta, x, y, _, observable = joint_solve(joint_record(self.values), float(start))
        return theta, np.array([x, y]), observable

    def cost(self, theta: float, translation: ArrayLike) -> float:
        """Return ``x' Q x`` at any transform: chi-square when the weights are 1 / variance."""
        x, y = np.asarray(translation, dtype=np.float64)
        return joint_cost(joint_record(self.values), float(theta), float(x), float(y))

    def information(self, theta: float) -> Floats:
        """Return the information of additive (x, y, theta) in the map frame at rotation `theta`, (3, 3)."""
        return information_of(self.values, float(theta))

    def covariance(self, theta: float) -> Floats:
        """Return the inverse of `information`, which has to be regular, (3, 3)."""
        return inverse_of(self.information(theta))


# The paper's estimator -----------------------------------------------------------------------------------------------


def _one_step_terms(pairs: Correspondences, reference: RigidTransform) -> Floats:
    """Return what each pair of weight 1 adds to the paper's sums about a reference, (12, n).

    The gap ``r`` is Eq. (1), sign corrected: p_S - p_D; the printed p_D - p_S returns exactly -T.
    """
    vx, vy = pairs.map_directions.T
    gap = cross(pairs.map_directions, pairs.map_midpoints - (reference.x, reference.y)) - pairs.offsets
    a, one = pairs.angles(reference.theta), np.ones(len(pairs))
    rows = one, vx * vx, vy * vy, vx * vy, -gap * vy, gap * vx, gap * gap
    return np.stack([*rows, a, a * a, 2.0 * np.sin(0.5 * a) ** 2, np.sin(a), one])


def eigen2(a: float, b: float, d: float) -> tuple[float, float, float, float]:
    """Return both eigenvalues of ``[[a, b], [b, d]]``, none below 0, the smaller first, and the smaller's axis."""
    big = 0.5 * (a + d) + math.sqrt(0.25 * (a - d) * (a - d) + b * b)
    small = max(0.0, a * d - b * b) / big if big > 0.0 else 0.0
    angle = 0.5 * math.atan2(-2.0 * b, d - a)
    return small, big, math.cos(angle), math.sin(angle)


def determinant_and_reliability(w: float, x2: float, y2: float, xy: float) -> tuple[float, float]:
    """Return Eq. (8)'s D, not below 0, and Eq. (28) from 0 to 1, ``2 sqrt(D) / S_w``."""
    determinant = max(0.0, x2 * y2 - xy * xy)
    return determinant, min(1.0, 2.0 * math.sqrt(determinant) / w) if w > 0.0 else 0.0


@dataclass(frozen=True, slots=True, eq=False)
class OneStepSums(CompensatedSums):
    """All that the paper's estimator needs of a set of pairs; adding or removing takes constant time.

    They are taken about one reference transform, which changes nothing but rounding and the point where angles wrap.
    The paper's Alg. 1 wraps each angle next to the one before (and as printed adds the differences in place of the
    angles): its sums then depend on the order, and an angle cannot be taken out again. With one reference angle for the
    whole set they do not, and it can. If angles spread over less than a half turn the mean is the same; pairs far
    off the reference should not be in the set.

    Moving the reference is done in plain doubles.

    Attributes
    ----------
    compensated : (2, 12)
        Values of `ONE_STEP_SUMS` and their errors, read-only.
    reference : RigidTransform
    """

    reference: RigidTransform = IDENTITY

    @classmethod
    def of_set(cls, pairs: Correspondences, weights: ArrayLike, reference: RigidTransform = IDENTITY) -> OneStepSums:
        """Sum over all pairs, `weights` (n,); those of weight 0 do not count."""
        return cls(_summed(_one_step_terms(pairs, reference), weights), reference)

    @classmethod
    def of_pair(
        cls, pairs: Correspondences, index: int, weight: float, reference: RigidTransform = IDENTITY
    ) -> OneStepSums:
        """Sum over pair `index` alone, in constant time."""
        return cls.of_set(pairs.take(slice(index, index + 1)), [weight], reference)

    def _alone(self, pairs: Correspondences, index: int, weight: float) -> OneStepSums:
        return self.of_pair(pairs, index, weight, self.reference)

    def _combined(self, other: OneStepSums, sign: float) -> OneStepSums:
        return CompensatedSums._combined(self, other.about(self.reference), sign)

    def about(self, reference: RigidTransform) -> OneStepSums:
        """Return the sums about another reference, without wrapping any angle again."""
        old = self.reference
        if reference == old:
            return self
        w, x2, y2, xy, px, py, _, angle, _, versine, sine, _ = self.values.tolist()
        dx, dy, turn = reference.x - old.x, reference.y - old.y, wrap_angle(reference.theta - old.theta)
        # Translations: r' = r - n . delta, with sum w n n' = [[S_y2, -S_xy], [-S_xy, S_x2]]. Angles: a' = a - turn.
        hx, hy = y2 * dx - xy * dy, x2 * dy - xy * dx
        gap2 = dx * (hx - 2.0 * px) + dy * (hy - 2.0 * py)
        change = [0.0, 0.0, 0.0, 0.0, -hx, -hy, gap2, -turn * w, turn * (turn * w - 2.0 * angle), 0.0, 0.0, 0.0]
        moved = _accumulated(self.compensated, np.stack([change, np.zeros(len(change))]))
        c, s, half = math.cos(turn), math.sin(turn), math.sin(0.5 * turn)
        moved[:, VERSINE] = versine * c + 2.0 * half * half * w - sine * s, 0.0
        moved[:, SINE] = sine * c - (w - versine) * s, 0.0
        return OneStepSums(moved, reference)

    @property
    def determinant(self) -> float:
        """Eq. (8)'s D, 0 for parallel lines (the paper calls it discriminant, and the lines collinear)."""
        w, x2, y2, xy = self.values[:4].tolist()
        return determinant_and_reliability(w, x2, y2, xy)[0]

    @property
    def reliability(self) -> float:
        """Eq. (28) from 0 to 1; ``2 sqrt(D) / S_w``. Knows the directions of the map lines and nothing of noise."""
        w, x2, y2, xy = self.values[:4].tolist()
        return determinant_and_reliability(w, x2, y2, xy)[1]

    def solve(self, rotation: Rotation) -> tuple[RigidTransform, bool]:
        """Return the paper's transform, map_from_scan, and whether the lines fix it.

        Mitsuta's mean angle is Eq. (9), Wahba's Eq. (15) with the right-hand normal ``(d_y, -d_x)``, for which alone it
        holds. The translation is Eqs. (7) and (8), with plus signs in D1 and D2 where minus is printed. For parallel
        lines it is the nearest to the reference.
        """
        w, x2, y2, xy, px, py, _, total, _, versine, sine, _ = self.values.tolist()
        mean = total / w if w > 0.0 else 0.0
        angle, at = math.atan2(sine, w - versine) if rotation == "wahba" else mean, self.reference
        determinant, observable = x2 * y2 - xy * xy, False
        # Along the normal that parallel lines share, the eigenvector of [[S_y2, -S_xy], [-S_xy, S_x2]].
        _, big, along_x, along_y = eigen2(y2, -xy, x2)
        x = y = 0.0
        if big > 0.0 and determinant > PARALLEL_RATIO * big * big:
            x, y, observable = (px * x2 + xy * py) / determinant, (py * y2 + xy * px) / determinant, True
        elif big > 0.0:
            length = (py * along_x - px * along_y) / big
            x, y = -length * along_y, length * along_x
        return RigidTransform(at.x + x, at.y + y, at.theta + angle), observable

    def translation_cost(self, at: RigidTransform) -> float:
        """Return ``A_t / k_t`` at any transform.

        Eq. (19) as printed holds at the optimum and at T = 0 only; this form holds everywhere.
        """
        return self.costs(at, "wahba")[0]

    def rotation_cost(self, at: RigidTransform, rotation: Rotation) -> float:
        """Return ``A_alpha / k_alpha`` at any transform.

        For Mitsuta the form of Eq. (17) that holds everywhere and not at the optimum alone; for Wahba Eqs. (13), (18).
        """
        return self.costs(at, rotation)[1]

    def costs(self, at: RigidTransform, rotation: Rotation) -> tuple[float, float]:
        """Return both `translation_cost` and `rotation_cost`."""
        values = self.about(at).values.tolist()
        return max(0.0, values[GAP2]), max(0.0, 2.0 * values[VERSINE] if rotation == "wahba" else values[ANGLE2])
