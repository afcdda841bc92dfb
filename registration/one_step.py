"""The paper's estimator: rotation first, then translation, from additive sums."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from .correspondences import Correspondences
from .kernels import of_arrays
from .kernels import one_step as kernels
from .options import Rotation
from .sums import CompensatedSums
from .transform import IDENTITY, RigidTransform, wrap_angle


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
    compensated : (2,) ONE_STEP_SUMS
        Values and their errors, read-only; `values` (12,).
    reference : RigidTransform
    """

    reference: RigidTransform = IDENTITY

    @classmethod
    def of_set(cls, pairs: Correspondences, weights: ArrayLike, reference: RigidTransform = IDENTITY) -> OneStepSums:
        """Sum over all pairs, `weights` (n,); those of weight 0 do not count."""
        at, checked = reference, np.ascontiguousarray(weights, dtype=np.float64)
        return cls(kernels.one_step_sums(pairs.rows, at.x, at.y, at.theta, checked), reference)

    @classmethod
    def of_pair(
        cls, pairs: Correspondences, index: int, weight: float, reference: RigidTransform = IDENTITY
    ) -> OneStepSums:
        """Sum over pair `index` alone, in constant time."""
        row, at = pairs.rows[index : index + 1], reference
        return cls(kernels.one_step_sums(row, at.x, at.y, at.theta, np.array([weight], dtype=np.float64)), reference)

    def add(self, pairs: Correspondences, index: int, weight: float) -> OneStepSums:
        """Return the sums with one pair more."""
        return self + self.of_pair(pairs, index, weight, self.reference)

    def remove(self, pairs: Correspondences, index: int, weight: float) -> OneStepSums:
        """Return the sums with one pair less; `weight` is the one that it was added with."""
        return self - self.of_pair(pairs, index, weight, self.reference)

    def _combined(self, other: OneStepSums, sign: float) -> OneStepSums:
        return CompensatedSums._combined(self, other.about(self.reference), sign)

    def about(self, reference: RigidTransform) -> OneStepSums:
        """Return the sums about another reference, without wrapping any angle again."""
        old = self.reference
        if reference == old:
            return self
        turn = wrap_angle(reference.theta - old.theta)
        return OneStepSums(
            kernels.one_step_moved(self.compensated, reference.x - old.x, reference.y - old.y, turn), reference
        )

    @property
    def determinant(self) -> float:
        """Eq. (8)'s D, 0 for parallel lines (the paper calls it discriminant, and the lines collinear)."""
        return of_arrays.direction_measures(self.compensated)[0]

    @property
    def reliability(self) -> float:
        """Eq. (28) from 0 to 1; ``2 sqrt(D) / S_w``. Knows the directions of the map lines and nothing of noise."""
        return of_arrays.direction_measures(self.compensated)[1]

    def solve(self, rotation: Rotation) -> tuple[RigidTransform, bool]:
        """Return the paper's transform, map_from_scan, and whether the lines fix it.

        Mitsuta's mean angle is Eq. (9), Wahba's Eq. (15) with the right-hand normal ``(d_y, -d_x)``, for which alone it
        holds. The translation is Eqs. (7) and (8), with plus signs in D1 and D2 where minus is printed. For parallel
        lines it is the nearest to the reference.
        """
        angle, x, y, observable = of_arrays.solve_one_step(self.compensated, rotation == "wahba")
        at = self.reference
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
        old = self.reference
        turn = wrap_angle(at.theta - old.theta)
        translation, mitsuta, wahba = kernels.one_step_costs(self.compensated, at.x - old.x, at.y - old.y, turn)
        return translation, wahba if rotation == "wahba" else mitsuta
