"""Twins of the kernels that grow and shrink a consensus set."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from association.layout import Integers, Place
from association.tuning import MAX_STEP, MAX_TURN, SPRING
from registration import RigidTransform
from registration.layout import Floats, Records

from .geometry import TURN, direction, normal, point, rotation, translation, wrap
from .matching import match_scan


def value_matches(scan: Records, matches: Records) -> float:
    """Give a match its gain less half its chi-square; one that is worth nothing is none."""
    for segment, match in zip(scan, matches, strict=True):
        match["worth"] = 0.0
        if match["wall"] >= 0:
            angle = math.asin(match["sine"])
            chi2 = match["offset"] ** 2 / segment["offset_variance"] + angle**2 / segment["angle_variance"]
            match["worth"] = max(0.0, segment["gain"] * match["overlap"] - 0.5 * chi2)
            match["wall"] = match["wall"] if match["worth"] > 0.0 else -1
    return float(matches["worth"].sum())


def solve(seen: Records, lines: Records, weights: Floats, start: RigidTransform) -> tuple[RigidTransform, Floats]:
    """Lay segments on lines, held by the spring to where they start; return the pose and its information.

    By the method of Levenberg and Marquardt from `start`. A segment counts as its mean, and as its direction times the
    root of its spread.
    """

    def residuals(x: Floats) -> Floats:
        return _linearised(seen, lines, weights, start, x)[0]

    def jacobian(x: Floats) -> Floats:
        return _linearised(seen, lines, weights, start, x)[1]

    begin = [start.x, start.y, start.theta]
    x = least_squares(residuals, begin, jacobian, method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15).x
    return RigidTransform(*x.tolist()), jacobian(x).T @ jacobian(x)


def _linearised(
    seen: Records, lines: Records, weights: Floats, start: RigidTransform, x: Floats
) -> tuple[Floats, Floats]:
    """Return the residuals at (x, y, theta), and their derivatives."""
    r, t, spring = rotation(x[2]), x[:2], math.sqrt(SPRING)
    residuals: list[float] = list(spring * (t - translation(start)))
    rows: list[Any] = [[spring, 0.0, 0.0], [0.0, spring, 0.0]]
    for one, line, weight in zip(seen, lines, weights, strict=True):
        n, root = normal(line), math.sqrt(weight)
        mean = r @ point(one, "centroid_x", "centroid_y")
        spread = math.sqrt(one["spread"]) * r @ direction(one)
        residuals += [root * float(n @ (mean + t) - line["offset"]), root * float(n @ spread)]
        rows += [root * np.array([*n, n @ TURN @ mean]), root * np.array([0.0, 0.0, n @ TURN @ spread])]
    return np.array(residuals), np.array(rows)


@dataclass(frozen=True)
class Refined:
    """What comes of a pose.

    Attributes
    ----------
    score : float
    pose : RigidTransform
    covariance : (3, 3)
    matches : (n,) of `MATCH`
    held : (n,) the walls that the pose was solved with last, or -1; where the rounds end early not those of `matches`
    """

    score: float
    pose: RigidTransform
    covariance: Floats
    matches: Records
    held: Integers


def refine(
    scan: Records, pose: RigidTransform, covariance: Floats, place: Place, gates: Records, rounds: int
) -> Refined:
    """Match and solve anew from nothing in every round."""
    held = np.full(len(scan), -1)
    for _ in range(rounds):
        matches, _ = match_scan(scan, pose, covariance, place, gates)
        if (matches["wall"] == held).all():
            break
        held = matches["wall"]
        some = held >= 0
        if not some.any():
            return Refined(0.0, pose, covariance, matches, held)
        solved, information = solve(scan[some], place.walls[held[some]], scan["weight"][some], pose)
        covariance = np.asarray(np.linalg.inv(information), np.float64)
        if abs(wrap(solved.theta - pose.theta)) > MAX_TURN or np.hypot(solved.x - pose.x, solved.y - pose.y) > MAX_STEP:
            break
        pose = solved
    matches, _ = match_scan(scan, pose, covariance, place, gates)
    return Refined(value_matches(scan, matches), pose, covariance, matches, held)
