"""Many scans from every pose of an environment, registered by several estimators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from registration import IDENTITY, RegistrationOptions, RegistrationResult, RigidTransform, register, wrap_angle

from .measuring import Measurement, Setup, take
from .scenes import MAKERS, UNIT, bound, poses, world

Floats = NDArray[np.float64]

# The paper's estimator, all weights one and weighted by the shorter length (Sec. 4.2); the same with the information
# 1 / variance of each offset for weight; the joint one.
ESTIMATORS = {
    "unweighted": RegistrationOptions(estimator="one_step", rotation="mitsuta", weighting="uniform"),
    "weighted": RegistrationOptions(estimator="one_step", rotation="mitsuta", weighting="shorter_length"),
    "information": RegistrationOptions(estimator="one_step", rotation="mitsuta", weighting="information"),
    "joint": RegistrationOptions(),
}
PAPERS = ("unweighted", "weighted")


@dataclass(frozen=True, slots=True)
class Condition:
    """Environment and settings of the scans.

    Attributes
    ----------
    world : str
    points : int
        Per scan.
    sigma : float
        Units.
    scans : int
        From each pose.
    seed : int
    setup : Setup
    estimators : tuple of str
        Of `ESTIMATORS`.
    """

    world: str
    points: int
    sigma: float
    scans: int
    seed: int
    setup: Setup = field(default_factory=Setup)
    estimators: tuple[str, ...] = PAPERS

    def rng(self, pose: int) -> np.random.Generator:
        """Return the generator of the scans from a pose, the same whatever is done with them."""
        return np.random.default_rng(
            [self.seed, list(MAKERS).index(self.world), self.points, round(1000 * self.sigma), self.scans, pose]
        )


@dataclass(frozen=True, slots=True, eq=False)
class Trials:
    """Results of a condition: arrays over pose, scan and, where it says e, estimator; nan where there is no answer.

    Attributes
    ----------
    condition : Condition
    errors : (poses, scans, e, 3)
        x and y in units, heading in radians, estimate less truth, in the map frame.
    own_errors : (poses, scans, e, 3)
        Of the transform itself: unlike `errors`, where the scan was moved before it was registered, not of the sensor.
    ambiguity : (poses, scans, e, 2)
        ``A_t`` in units^2 and ``A_alpha`` in rad^2 over the sum of the weights.
    weights : (poses, scans, e)
        The sum of the weights; lengths count in units.
    reliability : (poses, scans, e)
        Eq. (28).
    pairs : (poses, scans)
        Number of registered scans.
    fixed : (poses, scans)
        True if the pairs fix the pose, by the joint estimator.
    bounds : (poses, 3, 3)
        Cramer-Rao bounds, units and radians.
    """

    condition: Condition
    errors: Floats
    own_errors: Floats
    ambiguity: Floats
    weights: Floats
    reliability: Floats
    pairs: NDArray[np.int64]
    fixed: NDArray[np.bool_]
    bounds: Floats

    def of(self, estimator: str) -> int:
        """Return the place of an estimator on the axis e."""
        return self.condition.estimators.index(estimator)

    def squares(self, estimator: str, *, own: bool = False) -> Floats:
        """Return squared errors of position, units^2, and heading, rad^2: (poses, scans, 2), nan where not fixed."""
        off = (self.own_errors if own else self.errors)[:, :, self.of(estimator)]
        squares = np.stack([off[..., 0] ** 2 + off[..., 1] ** 2, off[..., 2] ** 2], axis=-1)
        return np.where(self.fixed[..., None], squares, np.nan)

    def ambiguities(self, estimator: str) -> Floats:
        """Return ``A_t`` and ``A_alpha`` over the sum of weights: (poses, scans, 2), nan where not fixed."""
        return np.where(self.fixed[..., None], self.ambiguity[:, :, self.of(estimator)], np.nan)


def run(condition: Condition) -> Trials:
    """Take the scans of a condition and register them."""
    places = poses(condition.world, condition.setup.places)
    shape = len(places), condition.scans, len(condition.estimators)
    trials = Trials(
        condition,
        errors=np.full((*shape, 3), np.nan),
        own_errors=np.full((*shape, 3), np.nan),
        ambiguity=np.full((*shape, 2), np.nan),
        weights=np.zeros(shape),
        reliability=np.zeros(shape),
        pairs=np.zeros(shape[:2], dtype=np.int64),
        fixed=np.zeros(shape[:2], dtype=np.bool_),
        bounds=np.array([bound(condition.world, pose, condition.points, condition.sigma) for pose in places]),
    )
    scene = world(condition.world)
    for i, pose in enumerate(places):
        rng = condition.rng(i)
        for j in range(condition.scans):
            scan = take(scene, pose, (condition.points, condition.sigma), condition.setup, rng)
            _register(trials, (i, j), scan, pose)
    return trials


def _register(trials: Trials, at: tuple[int, int], scan: Measurement, pose: RigidTransform) -> None:
    condition, segments = trials.condition, world(trials.condition.world).segments
    moved_from_scan = _moved_from_scan(condition.setup.origin, scan, pose)
    measured = scan.moved(moved_from_scan)
    trials.pairs[at] = len(scan.pairs)
    joint = register(segments, measured, scan.pairs)
    trials.fixed[at] = not joint.degenerate
    for k, name in enumerate(condition.estimators):
        found = joint if name == "joint" else register(segments, measured, scan.pairs, 0.0, ESTIMATORS[name])
        _note(trials, (*at, k), found)
        if found.pose is None:
            continue
        truth = pose.compose(moved_from_scan.inverse())
        trials.errors[(*at, k)] = _difference(found.pose.compose(moved_from_scan), pose)
        trials.own_errors[(*at, k)] = _difference(found.pose, truth)


def _note(trials: Trials, at: tuple[int, int, int], found: RegistrationResult) -> None:
    diagnostics, total = found.diagnostics, float(found.weights.sum())
    trials.reliability[at] = diagnostics.reliability
    if total > 0.0:
        by_length = trials.condition.estimators[at[2]] == "weighted"
        trials.weights[at] = total / UNIT if by_length else total
        trials.ambiguity[at] = (
            diagnostics.ambiguity.translation / total / UNIT**2,
            diagnostics.ambiguity.rotation / total,
        )


def _moved_from_scan(origin: str, scan: Measurement, pose: RigidTransform) -> RigidTransform:
    if origin == "map":
        return pose
    if origin == "middle" and len(scan.measured):
        x, y = scan.measured.segments.midpoints.mean(axis=0)
        return RigidTransform(-float(x), -float(y), 0.0)
    return IDENTITY


def _difference(found: RigidTransform, truth: RigidTransform) -> tuple[float, float, float]:
    return (found.x - truth.x) / UNIT, (found.y - truth.y) / UNIT, wrap_angle(found.theta - truth.theta)


def of_world(all_trials: Sequence[Trials], name: str) -> list[Trials]:
    """Return the trials of an environment."""
    return [t for t in all_trials if t.condition.world == name]
