"""Twins of the kernels of single beams."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from association.consensus.tuning import (
    BEAM_GATES,
    BEHIND,
    CERTAIN,
    FARTHER_BY,
    LEAST_INCIDENCE,
    LEAST_POINTS,
    NEAR,
    PASSED_SLACK,
    SURE_LENGTH,
    WALL_BEHIND,
)
from association.tables import Place, Rays
from registration import RigidTransform
from registration.layout import SEEN, Floats

from .consensus import Pairs, solve
from .geometry import direction, listed, normal
from .sight import first_hit

Evidence = tuple[float, float]  # read, passed


def angles_of(rays: Rays) -> Floats:
    """Return the directions of beams, radians."""
    angles: Floats = np.arctan2(rays.beams["dy"], rays.beams["dx"])
    return angles


def begins(rays: Rays) -> Floats:
    """Return where beams begin, (m, 2)."""
    return np.stack([rays.beams["x"], rays.beams["y"]], axis=1)


def offsets(
    rays: Rays, pose: RigidTransform, place: Place, obstacles: Place, behind: float
) -> Iterator[tuple[float, int, np.void]]:
    """Yield how much farther each beam reads than the first obstacle on its way, metres across that, and the obstacle.

    Those behind the walls are points: a beam that has passed one is compared with the walls alone.
    """
    for angle, distance, begin in zip(angles_of(rays) + pose.theta, rays.beams["range"], begins(rays), strict=True):
        if distance == math.inf:
            continue
        limit = min(rays.reach, distance + behind)
        expected, w = first_hit(pose.apply(begin), angle, limit, obstacles.walls)
        if w >= len(place.walls) and distance - expected > CERTAIN:
            expected, w = first_hit(pose.apply(begin), angle, limit, place.walls)
        if w >= 0:
            wall = obstacles.walls[w]
            sine = abs(normal(wall) @ [math.cos(angle), math.sin(angle)])
            yield (distance - expected) * max(LEAST_INCIDENCE, sine), w, wall


def beam_evidence(rays: Rays, pose: RigidTransform, place: Place, obstacles: Place) -> Evidence:
    """Compare every beam with the first wall on its way."""
    read = passed = 0.0
    for across, _, wall in offsets(rays, pose, place, obstacles, BEHIND):
        read += math.exp(-0.5 * (across / NEAR) ** 2)
        passed += min(1.0, (wall["end"] - wall["begin"]) / SURE_LENGTH) if across > CERTAIN else 0.0
    return read / max(1, len(rays.beams)), passed / max(1, len(rays.beams))


def beam_fractions(rays: Rays, pose: RigidTransform, place: Place, obstacles: Place) -> tuple[float, float, float]:
    """Count the beams that read farther than the walls of the map, and nearer than it shows.

    Then those that pass through what it shows, by the distance behind it.
    """
    found = list(offsets(rays, pose, place, obstacles, WALL_BEHIND))
    n = max(1, len(rays.beams))
    farther = sum(across > FARTHER_BY and w < len(place.walls) for across, w, _ in found)
    nearer = sum(across < -NEAR for across, _, _ in found)
    passed = sum(float(np.interp(across, (NEAR, 2.0 * NEAR), (0.0, 1.0))) for across, _, _ in found)
    return farther / n, nearer / n, passed / n


def refine_by_beams(rays: Rays, pose: RigidTransform, place: Place, gate: float) -> RigidTransform:
    """Lay the ends of the beams on the nearest of the walls that are listed where they are."""
    ends, lines = [], []
    for angle, distance, begin in zip(angles_of(rays), rays.beams["range"], begins(rays), strict=True):
        if distance == math.inf:
            continue
        end = begin + distance * np.array([math.cos(angle), math.sin(angle)])
        there = pose.apply(end)
        across = {}
        for w in listed(place.grid, there):
            wall = place.walls[w]
            if wall["begin"] - NEAR <= direction(wall) @ there <= wall["end"] + NEAR:
                across[w] = abs(normal(wall) @ there - wall["offset"])
        nearest = min(across, key=lambda w: across[w], default=-1)
        if nearest >= 0 and across[nearest] < gate:
            ends.append(end)
            lines.append(nearest)
    if len(lines) < LEAST_POINTS:
        return pose
    seen = np.zeros(len(ends), SEEN)
    seen["centroid_x"], seen["centroid_y"] = np.array(ends).T
    return solve(Pairs(seen, place.walls[lines], np.eye(2 * len(lines))), pose).pose


def weigh_beams(
    rays: Rays, pose: RigidTransform, place: Place, obstacles: Place
) -> tuple[RigidTransform, Evidence, Evidence]:
    """Return where a pose is moved to, and what the beams say there and where it was."""
    moved = pose
    for gate in BEAM_GATES:
        moved = refine_by_beams(rays, moved, place, gate)
    before, after = (beam_evidence(rays, at, place, obstacles) for at in (pose, moved))
    if after[0] > before[0] and after[1] <= before[1] + PASSED_SLACK:
        return moved, after, before
    return pose, before, before
