"""Twins of the kernels that grow, shrink and score a consensus set: generalised least squares, solved from nothing.

Each pair gives two residuals, the offset of its centroid and its direction times the root of its spread. Both have the
variance of the segment; the offsets of all pairs of a wall have the variance of the wall in common besides.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from association.consensus.tuning import FREE_DEVIATION, MAX_STEP, MAX_TURN, SAME_SHIFT, SPRING
from association.layout import MATCH, MODEL, Integers
from association.tables import Place
from registration import RigidTransform
from registration.layout import Floats, Record, Records

from .geometry import TURN, direction, normal, point, rotation, translation, wrap
from .matching import match_scan
from .reliability import least_reliability, reliability


@dataclass(frozen=True)
class Pairs:
    """Scan lines on walls, and what their residuals are compared with.

    Attributes
    ----------
    scan : (n,) of `SCAN_LINE`
    walls : (n,) of `WALL`, that of each line
    covariance : (2 n, 2 n) of all offsets, m^2, and behind them of all directions times the root of the spread
    """

    scan: Records
    walls: Records
    covariance: Floats

    @classmethod
    def of(
        cls,
        scan: Records,
        held: Integers,
        walls: Records,
        wall_variance: float,
        ties: Floats | None = None,
        shifts: Floats | None = None,
    ) -> Pairs:
        """Take the scan lines on a wall; `held` (n,) is the wall of each or -1.

        The errors of walls are correlated by their ties; the line that a scan line lies on is off its wall by its
        shift, (n,).
        """
        on = np.asarray(held) >= 0
        chosen, wall = scan[on], held[on]
        own = np.diag(np.tile(1.0 / chosen["weight"], 2))
        common = np.zeros_like(own)
        common[: len(wall), : len(wall)] = wall_variance * correlations(wall, walls, ties)
        lines = walls[wall]
        if shifts is not None:
            lines["offset"] += shifts[on]
        return cls(chosen, lines, own + common)

    def residuals(self, at: RigidTransform) -> Floats:
        """Return the residuals at a pose, (2 n,) metres."""
        offsets, turns = [], []
        for one, wall in zip(self.scan, self.walls, strict=True):
            r, n = rotation(at.theta), normal(wall)
            mean = r @ point(one, "centroid_x", "centroid_y") + translation(at)
            offsets.append(float(n @ mean - wall["offset"]))
            turns.append(math.sqrt(one["spread"]) * float(n @ r @ direction(one)))
        return np.array(offsets + turns)

    def derivatives(self, theta: float) -> Floats:
        """Return those of the residuals by x, y and theta, (2 n, 3)."""
        offsets, turns = [], []
        for one, wall in zip(self.scan, self.walls, strict=True):
            r, n = rotation(theta), normal(wall)
            offsets.append([*n, n @ TURN @ r @ point(one, "centroid_x", "centroid_y")])
            turns.append([0.0, 0.0, math.sqrt(one["spread"]) * (n @ TURN @ r @ direction(one))])
        return np.array(offsets + turns).reshape(-1, 3)

    def cost(self, at: RigidTransform) -> float:
        """Return the chi-square of the residuals at a pose."""
        r = self.residuals(at)
        return float(r @ np.linalg.solve(self.covariance, r))

    def one_step_cost(self, start: RigidTransform) -> float:
        """Return the cost at Wahba's rotation and its best translation, which the spring holds to `start`."""
        trust = self.scan["weight"] * self.scan["spread"]
        turns = [
            complex(*direction(wall)) / complex(*direction(one))
            for one, wall in zip(self.scan, self.walls, strict=True)
        ]
        theta = float(np.angle(trust @ np.array(turns)))
        held = RigidTransform(start.x, start.y, theta)
        whitening, spring = np.linalg.inv(np.linalg.cholesky(self.covariance)), math.sqrt(SPRING) * np.eye(2)
        rows = np.vstack([spring, whitening @ self.derivatives(theta)[:, :2]])
        step = np.linalg.lstsq(rows, -np.concatenate([np.zeros(2), whitening @ self.residuals(held)]))[0]
        return self.cost(RigidTransform(start.x + step[0], start.y + step[1], theta))

    def information(self, theta: float) -> Floats:
        """Return the information of (x, y, theta), (3, 3)."""
        j = self.derivatives(theta)
        return np.asarray(j.T @ np.linalg.solve(self.covariance, j))


def correlations(wall: Integers, walls: Records, ties: Floats | None) -> Floats:
    """Return how the errors of some walls (n,) are correlated, (n, n); without ties only with themselves."""
    places = (np.full(len(walls), -1.0) if ties is None else ties)[wall]
    apart = np.where(np.minimum.outer(places, places) < 0.0, np.inf, np.abs(places[:, None] - places))
    return np.exp(-np.where(wall[:, None] == wall, 0.0, apart))


@dataclass(frozen=True)
class Solved:
    """Pose of least cost of the pairs, held by the spring to the start of the search."""

    pose: RigidTransform
    information: Floats
    cost: float


def solve(pairs: Pairs, start: RigidTransform, held: float = SPRING) -> Solved:
    """Minimise cost and spring by the method of Levenberg and Marquardt from `start`, which that holds so, 1/m^2."""
    whitening, spring = np.linalg.inv(np.linalg.cholesky(pairs.covariance)), math.sqrt(held)

    def residuals(x: Floats) -> Floats:
        return np.concatenate(
            [spring * (x[:2] - translation(start)), whitening @ pairs.residuals(RigidTransform(*x.tolist()))]
        )

    def jacobian(x: Floats) -> Floats:
        return np.concatenate([spring * np.eye(2, 3), whitening @ pairs.derivatives(x[2])])

    begin = [start.x, start.y, start.theta]
    found = least_squares(residuals, begin, jacobian, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    j = jacobian(found.x)
    return Solved(RigidTransform(*found.x.tolist()), j.T @ j, 2.0 * float(found.cost))


def log_determinant(information: Floats, model: Record) -> float:
    """Return half of the logarithm of ``det(1 + F S)``."""
    s = np.diag([model["free_distance"] ** 2, model["free_distance"] ** 2, model["free_angle"] ** 2])
    return 0.5 * float(np.log(np.linalg.det(np.eye(3) + information @ s)))


def score_pairs(scan: Records, at: RigidTransform, place: Place, wall_variance: float, matches: Records) -> float:
    """Give each match what the set loses without it at this pose; what is score nothing is no match."""
    held = matches["wall"].copy()

    def cost(held: Integers) -> float:
        return Pairs.of(scan, held, place.walls, wall_variance, place.ties, matches["shift"]).cost(at)

    whole = cost(held)
    matches["score"] = 0.0
    total = 0.0
    for i in np.nonzero(held >= 0)[0]:
        others = np.where(np.arange(len(held)) == i, -1, held)
        gain = float(matches["gain"][i])
        score = gain - 0.5 * (whole - cost(others))
        if score > 0.0:
            matches["score"][i] = score
            total += gain
        else:
            matches["wall"][i] = -1
    return total


@dataclass(frozen=True)
class Refined:
    """Consensus set of a pose.

    Attributes
    ----------
    score : float
    pose : RigidTransform
    covariance : (3, 3)
    matches : (n,) of `MATCH`
    cost : float
        In the score; 0 where that is 0.
    free : bool
        Whether in any round the spring alone held a direction: rounding of the sums then moves the pose along it.
    """

    score: float
    pose: RigidTransform
    covariance: Floats
    matches: Records
    cost: float = 0.0
    free: bool = False


def refine(
    scan: Records, start: RigidTransform, spread: Floats, place: Place, gates: Records, model: Records, rounds: int
) -> Refined:
    """Match and solve again from nothing in every round; `start` has the covariance `spread`."""
    variance = float(model["wall_variance"][0])
    pose, covariance = start, spread
    held, cost, information, free = np.full(len(scan), -1), 0.0, np.zeros((3, 3)), False
    shifts = np.zeros(len(scan))

    def matched() -> Records:
        found, _ = match_scan(scan, pose, covariance, place, gates)
        found["gain"] = np.maximum(0.0, found["gain"] - 0.5 * scan["weight"] * found["uneven"])
        return found

    def moved() -> bool:
        nonlocal pose, covariance, cost, information, free
        pairs = Pairs.of(scan, held, place.walls, variance, place.ties, shifts)
        solved = solve(pairs, pose)
        information, covariance = solved.information, np.asarray(np.linalg.inv(solved.information))
        free = free or bool(np.trace(covariance) > 0.1 / SPRING)
        turn, step = wrap(solved.pose.theta - pose.theta), np.hypot(solved.pose.x - pose.x, solved.pose.y - pose.y)
        near = bool(abs(turn) <= MAX_TURN and step <= MAX_STEP)
        cost = solved.cost if near else pairs.cost(pose)
        before, pose = pose, solved.pose if near else pose
        if reliability(scan, held, place.walls) <= least_reliability(scan, held, place.walls):
            along = np.linalg.eigh(information[:2, :2])[1][:, 0]
            x, y = translation(pose) - along * (along @ (translation(pose) - translation(before)))
            pose = RigidTransform(x, y, pose.theta)
            covariance[:2, :2] += FREE_DEVIATION**2 * np.outer(along, along)
            cost = pairs.cost(pose)
        return near

    for _ in range(rounds):
        matches = matched()
        if (matches["wall"] == held).all() and (abs(matches["shift"] - shifts)[held >= 0] <= SAME_SHIFT).all():
            break
        held, shifts = matches["wall"].copy(), matches["shift"].copy()
        if not (held >= 0).any():
            return Refined(0.0, pose, covariance, matches, free=free)
        if not moved():
            break
    matches = matched()
    before, grown = held, matches["wall"].copy()
    shifts = matches["shift"].copy()
    gain = score_pairs(scan, pose, place, variance, matches)
    held = matches["wall"].copy()
    if not (held >= 0).any():
        return Refined(0.0, pose, covariance, matches, free=free)
    if (grown != before).any() or (held != grown).any():  # those that come and are score nothing count as a change
        moved()
    score = gain - 0.5 * cost - log_determinant(information, model[0])
    return Refined(max(0.0, score), pose, covariance, matches, cost if score > 0.0 else 0.0, free)


def model_of(wall_variance: float, free_distance: float, free_angle: float) -> Records:
    """Return these, (1,) of `MODEL`."""
    model = np.zeros(1, MODEL)
    model[0] = wall_variance, free_distance, free_angle
    return model


def matches_on(walls: Integers, scan: Records | None = None) -> Records:
    """Return whole matches with these walls, or -1, of the lines of a scan where they are to gain something."""
    matches = np.zeros(len(walls), MATCH)
    matches["wall"] = walls
    matches["overlap"] = matches["wall"] >= 0
    if scan is not None:
        matches["gain"] = scan["gain"] * matches["overlap"]
    return matches
