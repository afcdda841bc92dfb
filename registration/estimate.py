"""The two estimators, each from pairs to a fit."""

from __future__ import annotations

from dataclasses import dataclass

from .correspondences import Correspondences
from .joint import JointSums
from .kernels.one_step import wahba_angle
from .kernels.pairs import middles
from .observability import Freedom, are_parallel, find_freedom
from .one_step import OneStepSums
from .options import RegistrationOptions, Rotation
from .orientation import choose_rotation
from .transform import RigidTransform, wrap_angle
from .weights import PairWeights


@dataclass(frozen=True, slots=True, eq=False)
class Problem:
    """What an estimator is given: pairs, one of a positive weight at least.

    Attributes
    ----------
    pairs : Correspondences
        In the scan's own frame, and in a *local* map frame whose origin is in the middle of the map segments.
    centred : Correspondences
        The pairs about the middles of both sets: what the joint sums are taken of, to lose no digits.
    weights : PairWeights
    map_from_local, scan_from_centred : RigidTransform
        Shifts by those middles, metres.
    count : int
        How many pairs count.
    reference_angle : float
        Wahba's angle, radians: where angles wrap is opposite to it.
    unique : bool
        Only one way to turn the segments round fits; always so where directions mean something.
    """

    pairs: Correspondences
    centred: Correspondences
    weights: PairWeights
    map_from_local: RigidTransform
    scan_from_centred: RigidTransform
    count: int
    reference_angle: float
    unique: bool

    @classmethod
    def of(cls, given: Correspondences, weights: PairWeights, *, oriented: bool) -> Problem:
        """Recentre, and turn segments round where directions mean nothing."""
        map_x, map_y, scan_x, scan_y, count = middles(given.rows, weights.used)
        local = given.about((map_x, map_y), (0.0, 0.0))
        centred = local.about((0.0, 0.0), (scan_x, scan_y))
        unique = True
        if not oriented:
            judged = weights.used if weights.noise is None else weights.noise
            theta, unique = choose_rotation(centred, judged, is_noise=weights.noise is not None)
            against = centred.runs_against(theta)
            local, centred = local.turned(against), centred.turned(against)
        angle = wrap_angle(wahba_angle(local.rows, weights.used))
        shifts = RigidTransform(map_x, map_y, 0.0), RigidTransform(scan_x, scan_y, 0.0)
        return cls(local, centred, weights, *shifts, count, angle, unique)

    def one_step_sums(self, x: float, y: float) -> OneStepSums:
        """Return the paper's sums about a transform, local from scan."""
        return OneStepSums.of_set(self.pairs, self.weights.used, RigidTransform(x, y, self.reference_angle))

    def angle(self, rotation: Rotation) -> float:
        """Return the paper's rotation, radians."""
        return self.one_step_sums(0.0, 0.0).solve(rotation)[0].theta


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """What an estimator answers.

    Attributes
    ----------
    local_from_scan : RigidTransform
    local_from_centred : RigidTransform
        The same between the frames about the middles of both sets.
    freedom : Freedom
    sums : JointSums
        About those middles, with the estimator's weights.
    """

    local_from_scan: RigidTransform
    local_from_centred: RigidTransform
    freedom: Freedom
    sums: JointSums

    def moved_least(self, problem: Problem) -> Fit:
        """Return the fit whose translation in the caller's frames is shortest along the free direction."""
        if self.freedom.direction is None:
            return self
        (x, y), slack = self.freedom.direction, self.freedom.slack
        pose = problem.map_from_local.compose(self.local_from_scan)
        back = -min(slack, max(-slack, x * pose.x + y * pose.y))
        slide = RigidTransform(back * x, back * y, 0.0)
        moved = slide.compose(self.local_from_scan), slide.compose(self.local_from_centred)
        return Fit(*moved, self.freedom, self.sums)


def fit_joint(problem: Problem, options: RegistrationOptions) -> Fit:
    """Fit rotation and translation together; the same wherever the two frames have their origins."""
    sums = JointSums.of_set(problem.centred, problem.weights.used)
    theta, (x, y), _ = sums.solve(problem.angle(options.rotation))
    local_from_centred = RigidTransform(float(x), float(y), theta)
    local_from_scan = local_from_centred.compose(problem.scan_from_centred.inverse())
    return Fit(local_from_scan, local_from_centred, _freedom(problem, sums, theta), sums).moved_least(problem)


def fit_one_step(problem: Problem, options: RegistrationOptions) -> Fit:
    """Fit as the paper does: in the caller's frames, on whose origins its translation depends.

    Moving the map's origin moves the answer along and no more, so the map may be recentred; the scan may not. A second
    pass about the first answer takes out what the first lost to rounding.
    """
    theta = problem.angle(options.rotation)
    at = RigidTransform(0.0, 0.0, theta)
    for _ in range(2):
        at, observable = problem.one_step_sums(at.x, at.y).solve(options.rotation)
    at = RigidTransform(at.x, at.y, theta)
    sums = JointSums.of_set(problem.centred, problem.weights.used)
    freedom = _freedom(problem, sums, theta)
    fit = Fit(at, at.compose(problem.scan_from_centred), freedom, sums)
    # Where the paper has an answer, that one is given.
    return fit if observable else fit.moved_least(problem)


def fit_at(problem: Problem, pose: RigidTransform) -> Fit:
    """Take a transform, map_from_scan, for the answer."""
    local_from_scan = problem.map_from_local.inverse().compose(pose)
    sums = JointSums.of_set(problem.centred, problem.weights.used)
    freedom = _freedom(problem, sums, pose.theta)
    return Fit(local_from_scan, local_from_scan.compose(problem.scan_from_centred), freedom, sums)


def _freedom(problem: Problem, sums: JointSums, theta: float) -> Freedom:
    noise = problem.weights.noise
    parallel = noise is not None and are_parallel(problem.centred, noise)
    if noise is problem.weights.used:
        return find_freedom(sums, sums, theta, parallel=parallel)
    of_noise = None if noise is None else JointSums.of_set(problem.centred, noise)
    return find_freedom(sums, of_noise, theta, parallel=parallel)
