"""Twins of the kernels that rank."""

from __future__ import annotations

from typing import Any

import numpy as np

from association.consensus.tuning import FAR_BEHIND, ROUNDS, START_ANGLE_VARIANCE, START_VARIANCE
from association.layout import SET_SCORE
from association.tables import Place
from registration import RigidTransform
from registration.layout import Floats, Records

from .consensus import Pairs, refine
from .geometry import Vector, wrap
from .sight import count_blockers, sight_penalty

START = np.diag([START_VARIANCE, START_VARIANCE, START_ANGLE_VARIANCE])
Ranked = tuple[RigidTransform, Floats, Records, Records]  # pose, covariance, (1,) of `SET_SCORE`, matches


def rank(
    scan: Records,
    poses: list[RigidTransform],
    viewpoint: Vector | None,
    place: Place,
    gates: Records,
    model: Records,
) -> list[Ranked]:
    """Refine one pose after the other; lines of sight from the viewpoint count for those that are not far behind."""
    ranked: list[Ranked] = []
    best = 0.0
    for at in poses:
        found = refine(scan, at, START, place, gates, model, ROUNDS)
        score, matches, on = found.score, found.matches, found.matches["wall"] >= 0
        scored = np.zeros(1, SET_SCORE)
        scored["chi_square"] = found.cost
        scored["length"] = scan["length"][on].sum()
        scored["fraction"] = scan["length"][on].sum() / scan["length"].sum()
        pairs = Pairs.of(scan, matches["wall"], place.walls, float(model["wall_variance"][0]))
        if score > 0.0:
            scored["one_step_chi_square"] = pairs.one_step_cost(found.pose)
        scored["misfit"] = (matches["offset"][on] ** 2 / scan["plain_variance"][on]).mean() if on.any() else 0.0
        scored["count"] = on.sum()
        if viewpoint is not None and score > best - FAR_BEHIND:
            scored["blocked"] = sight_penalty(count_blockers(scan, on, viewpoint, found.pose, place.walls), place.walls)
            score -= float(scored["blocked"][0])
            best = max(best, score)
        scored["score"] = score
        ranked.append((found.pose, found.covariance, scored, matches))
    return ranked


def distinct(
    poses: list[RigidTransform],
    covariances: Floats,
    scores: Floats,
    order: Any,
    most: int,
    rules: tuple[float, float, float, float],
) -> list[int]:
    """Take the best pose, strike what it stands for by the last four arguments of `distinct_poses`, and so on."""
    distance, angle, family, much_better = rules
    left: list[int] = np.asarray(order).tolist()
    kept: list[int] = []
    while left and len(kept) < most:
        best = left.pop(0)
        kept.append(best)
        information = np.linalg.inv(covariances[best])
        steps = {i: _step(poses[best], poses[i]) for i in left}
        near = {i for i, s in steps.items() if np.hypot(s[0], s[1]) < distance and abs(s[2]) < angle}
        struck = {
            i for i, s in steps.items() if s @ information @ s < family and scores[i] <= scores[best] + much_better
        }
        left = [i for i in left if i not in near | struck]
    return kept


def _step(one: RigidTransform, other: RigidTransform) -> Floats:
    return np.array([other.x - one.x, other.y - one.y, wrap(other.theta - one.theta)])
