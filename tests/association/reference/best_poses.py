"""Twins of the kernels that keep the best poses."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from association.options import HardPrior, Prior, SoftPrior
from association.tuning import INSIDE, SOFT_FLOOR
from registration import RigidTransform

from .geometry import wrap


def prior_value(prior: Prior | None, pose: RigidTransform) -> float:
    """Return what a prior in the index frame says of a pose, by its definition."""
    if isinstance(prior, HardPrior):
        return INSIDE if prior.contains(pose) else 0.0
    if isinstance(prior, SoftPrior):
        step = np.array([pose.x - prior.pose.x, pose.y - prior.pose.y, wrap(pose.theta - prior.pose.theta)])
        return max(SOFT_FLOOR, -0.5 * float(step @ np.linalg.solve(prior.covariance, step)))
    return 0.0


@dataclass
class BestPoses:
    """A list of (pose, score, value), with what goes on it."""

    size: int
    distance: float
    angle: float
    kept: list[tuple[RigidTransform, float, float]] = field(default_factory=list)

    def keep(self, pose: RigidTransform, score: float, value: float) -> None:
        """Put a pose in the place of the best one near it; where none is near, at the end or in the worst one's."""
        values = [one[2] for one in self.kept]
        near = [k for k, (other, _, _) in enumerate(self.kept) if self._near(other, pose)]
        if near:
            place = max(near, key=lambda k: values[k])
        elif len(self.kept) < self.size:
            self.kept.append((pose, score, value))
            return
        else:
            place = values.index(min(values))
        if value > values[place]:
            self.kept[place] = (pose, score, value)

    @property
    def least_kept(self) -> float:
        """The least value of a full list, else 0."""
        return min(value for _, _, value in self.kept) if len(self.kept) == self.size else 0.0

    def _near(self, one: RigidTransform, other: RigidTransform) -> bool:
        off = max(abs(one.x - other.x), abs(one.y - other.y))
        return off < self.distance and abs(math.remainder(one.theta - other.theta, math.tau)) < self.angle
