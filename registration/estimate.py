"""The two estimators, each from pairs to a fit."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .correspondences import Correspondences
from .joint import JointSums
from .observability import Freedom, find_freedom
from .one_step import OneStepSums
from .options import RegistrationOptions, Rotation
from .transform import RigidTransform
from .weights import PairWeights

Floats = NDArray[np.float64]


def rotation_matrix(theta: float) -> Floats:
    """Return the (2, 2) matrix that turns by `theta` radians, Eq. (12)."""
    c, s = math.cos(theta), math.sin(theta)
    return np.array([[c, -s], [s, c]])


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """What an estimator is given: n > 0 pairs of positive weight.

    Attributes
    ----------
    pairs : Correspondences
        In the scan's own frame, and in a map frame whose origin is in the middle of the map segments.
    centred : Correspondences
        The pairs about the middles of both sets: what the joint sums are taken of, to lose no digits.
    weights : PairWeights
    map_origin : (2,)
        That origin, in the caller's map frame, metres.
    scan_origin : (2,)
        The middle of the scan segments, in the scan frame, metres.
    reference_angle : float
        Wahba's angle, radians: where angles wrap is opposite to it.
    """

    pairs: Correspondences
    centred: Correspondences
    weights: PairWeights
    map_origin: Floats
    scan_origin: Floats
    reference_angle: float

    def one_step_sums(self, x: float, y: float) -> OneStepSums:
        """Return the paper's sums about a transform, here of the recentred map frame."""
        return OneStepSums.of_set(self.pairs, self.weights.used, RigidTransform(x, y, self.reference_angle))

    def angle(self, rotation: Rotation) -> float:
        """Return the paper's rotation, radians."""
        return self.one_step_sums(0.0, 0.0).solve(rotation)[0].theta


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """What an estimator answers.

    Attributes
    ----------
    theta : float
        Radians.
    translation : (2,)
        Of the transform between the frames about the middles of both sets, metres.
    freedom : Freedom
    """

    theta: float
    translation: Floats
    freedom: Freedom

    def local_translation(self, problem: Problem) -> Floats:
        """Return the translation from the scan's own frame into the recentred map frame, metres."""
        return self.translation - rotation_matrix(self.theta) @ problem.scan_origin

    def moved_least(self, problem: Problem) -> Fit:
        """Return the fit whose translation in the caller's frames is shortest along the free direction."""
        direction = self.freedom.direction
        if direction is None:
            return self
        along = float(direction @ (self.local_translation(problem) + problem.map_origin))
        slack = self.freedom.slack
        return replace(self, translation=self.translation - min(slack, max(-slack, along)) * direction)


def fit_joint(problem: Problem, options: RegistrationOptions) -> Fit:
    """Fit rotation and translation together; the same wherever the two frames have their origins."""
    sums = JointSums.of_set(problem.centred, problem.weights.used)
    theta, translation, _ = sums.solve(problem.angle(options.rotation))
    return Fit(theta, translation, _freedom(problem, sums, theta)).moved_least(problem)


def fit_one_step(problem: Problem, options: RegistrationOptions) -> Fit:
    """Fit as the paper does: in the caller's frames, on whose origins its translation depends.

    Moving the map's origin moves the answer along and no more, so the map may be recentred; the scan may not. A second
    pass about the first answer takes out what the first lost to rounding.
    """
    theta = problem.angle(options.rotation)
    at = RigidTransform(0.0, 0.0, theta)
    for _ in range(2):
        at, observable = problem.one_step_sums(at.x, at.y).solve(options.rotation)
    translation = np.array([at.x, at.y]) + rotation_matrix(theta) @ problem.scan_origin
    freedom = _freedom(problem, JointSums.of_set(problem.centred, problem.weights.used), theta)
    if observable:
        # The paper has an answer, so that one is given.
        return Fit(theta, translation, replace(freedom, slack=0.0))
    return Fit(theta, translation, freedom).moved_least(problem)


def _freedom(problem: Problem, sums: JointSums, theta: float) -> Freedom:
    noise = problem.weights.noise
    if noise is problem.weights.used:
        return find_freedom(sums, sums, theta)
    return find_freedom(sums, None if noise is None else JointSums.of_set(problem.centred, noise), theta)
