"""Twins of the kernels that estimate poses: every set of pairs is solved from nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from association.consensus.tuning import (
    COMMON_WALL_ERROR,
    ESTIMATION_ROUNDS,
    FREE_DEVIATION,
    LEAST_KNOWN_VARIANCE,
    LEAST_WALL_ERROR,
    MAX_STEP,
    MAX_TURN,
    ROUGH_FRACTION,
    UNSEEN_ERROR,
    USUAL_WALL_ERROR,
    USUAL_WALLS,
)
from association.layout import Integers
from association.tuning import ROUGHNESS
from registration import RigidTransform
from registration.kernels import MAX_DEVIATION
from registration.layout import Floats, Records

from .consensus import Pairs, solve
from .geometry import wrap
from .reliability import least_reliability, reliability


def reweighted(scan: Records, variance: float) -> Records:
    """Return the lines with the weights that they have on walls which are so rough along themselves."""
    out = scan.copy()
    out["weight"] = 1.0 / (1.0 / scan["weight"] - ROUGHNESS**2 + ROUGH_FRACTION * variance)
    return out


def pairs_of(scan: Records, held: Integers, walls: Records, variance: float) -> Pairs:
    return Pairs.of(reweighted(scan, variance), held, walls, variance)


@dataclass(frozen=True)
class Moved:
    """Where pairs lay a pose, its covariance of (x, y, theta), and whether it is near enough to go there."""

    pose: RigidTransform
    covariance: Floats
    near: bool

    @property
    def weakest(self) -> tuple[float, Floats]:
        """The deviation of the position along its weakest direction, and that direction up to its sign."""
        values, vectors = np.linalg.eigh(self.covariance[:2, :2])
        return math.sqrt(values[1]), vectors[:, 1]


def moved(pairs: Pairs, start: RigidTransform) -> Moved:
    found = solve(pairs, start)
    turn, step = wrap(found.pose.theta - start.theta), math.hypot(found.pose.x - start.x, found.pose.y - start.y)
    near = abs(turn) <= MAX_TURN and step <= MAX_STEP
    return Moved(found.pose if near else start, np.asarray(np.linalg.inv(found.information), np.float64), near)


def estimated_variance(at: Moved, scan: Records, held: Integers, walls: Records, variance: float) -> float:
    """Compare the mean residual of each wall with what its lines and the pose leave it."""
    found, count = USUAL_WALLS * USUAL_WALL_ERROR**2, USUAL_WALLS
    for w in sorted(set(held[held >= 0].tolist())):
        own = pairs_of(scan, np.where(held == w, held, -1), walls, 0.0)
        weights = reweighted(scan, variance)["weight"][held == w]
        n = len(weights)
        mean = np.average(own.residuals(at.pose)[:n], weights=weights)
        gradient = np.average(own.derivatives(at.pose.theta)[:n], axis=0, weights=weights)
        noise = 1.0 / weights.sum()
        free = max(0.0, 1.0 - gradient @ at.covariance @ gradient / (variance + noise))
        found += mean**2 - free * noise
        count += free
    return float(UNSEEN_ERROR * max(found / count, LEAST_WALL_ERROR**2) * (1.0 + 2.0 / max(1.0, count - 2.0)))


@dataclass(frozen=True)
class Hinge:
    """A pose without one of its walls."""

    wall: int
    moves: float
    deviation: float
    direction: Floats


@dataclass(frozen=True)
class EstimatedPose:
    """A pose worked out; see `association.consensus.estimation`."""

    at: Moved
    variance: float
    weakest: float
    direction: Floats
    parallel: bool
    leverages: list[Hinge]


def estimate_poses(
    scan: Records, held: Integers, walls: Records, start: RigidTransform, known: float | None
) -> EstimatedPose:
    """Solve, estimate, and solve again; `known` is the variance of the map's walls, m^2, or None."""
    variance = USUAL_WALL_ERROR**2 if known is None else max(known, LEAST_KNOWN_VARIANCE)
    pose = start
    for _ in range(ESTIMATION_ROUNDS if known is None else 1):
        at = moved(pairs_of(scan, held, walls, variance), pose)
        if not at.near:
            break
        pose = at.pose
        if known is None:
            variance = estimated_variance(at, scan, held, walls, variance)
    weakest, along = moved(pairs_of(scan, held, walls, max(variance, COMMON_WALL_ERROR**2)), pose).weakest
    at = moved(pairs_of(scan, held, walls, variance), pose)
    weighted, without = reweighted(scan, variance), leverages(scan, held, walls, at, variance)
    parallel = reliability(weighted, held, walls) <= least_reliability(weighted, held, walls)
    if not parallel and weakest <= MAX_DEVIATION:
        found = solve(Pairs.of(registering(scan, held, variance), held, walls, 0.0), at.pose, 0.0)
        at = Moved(found.pose, np.asarray(np.linalg.inv(found.information)), near=True)
    return EstimatedPose(at, variance, weakest, along, parallel, without)


def registering(scan: Records, held: Integers, variance: float) -> Records:
    """Return the lines with the weights that they register with: lines on one wall share its error."""
    out, alone = scan.copy(), 1.0 / (1.0 / scan["weight"] - ROUGHNESS**2)
    for w in set(held[held >= 0].tolist()):
        on = held == w
        out["weight"][on] = alone[on] / (1.0 + variance * alone[on].sum())
    return out


def leverages(scan: Records, held: Integers, walls: Records, at: Moved, variance: float) -> list[Hinge]:
    """Leave each wall out, in the order in which the lines come on them."""
    out = []
    for w in dict.fromkeys(held[held >= 0].tolist()):
        without = moved(pairs_of(scan, np.where(held == w, -1, held), walls, variance), at.pose)
        step = np.array([without.pose.x - at.pose.x, without.pose.y - at.pose.y])
        moves, (deviation, along) = float(np.hypot(*step)), without.weakest
        if not without.near:
            deviation = FREE_DEVIATION
        elif moves > deviation:
            along = step / moves
        out.append(Hinge(w, moves, deviation, along))
    return out
