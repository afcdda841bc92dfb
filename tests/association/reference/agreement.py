"""Twins of the kernels that compare what is seen with what the map shows."""

from __future__ import annotations

import itertools
import math

import numpy as np

from association.consensus.tuning import (
    AGREEING,
    AGREEING_FRACTION,
    BLIND_FRACTION,
    MISSING_LENGTH,
    MISSING_RANGE,
    MISSING_SINE,
    NEUTRAL,
)
from association.layout import WALL
from association.tuning import FAR, FARTHER, RAYS
from registration import RigidTransform
from registration.layout import Floats, Records

from .geometry import Vector, direction, normal, point
from .sight import first_hit


def angles_of(rays: int) -> Floats:
    return np.asarray(math.tau * (np.arange(rays) + 0.5) / rays)


def scan_distances(scan: Records, viewpoint: Vector, rays: int) -> tuple[Floats, float]:
    """Send rays at the segments as if they were walls; return distances, and how far the scan reaches."""
    walls = np.zeros(len(scan), WALL)
    along = np.einsum("ij,ij->i", direction(scan), point(scan))
    walls["dx"], walls["dy"], walls["offset"] = scan["dx"], scan["dy"], np.einsum("ij,ij->i", normal(scan), point(scan))
    walls["begin"], walls["end"] = along - scan["length"] / 2, along + scan["length"] / 2
    distances = [first_hit(viewpoint, angle, math.inf, walls)[0] for angle in angles_of(rays)]
    farthest = max(math.dist(point(row), np.asarray(viewpoint)) + row["length"] / 2 for row in scan)
    return np.array(distances), float(farthest)


def in_view(distances: Floats) -> list[bool]:
    """Strike the widest gap if it is wide, of equal ones that over angle 0, then the first."""
    looked = [k for k, distance in enumerate(distances) if distance < math.inf]
    rays = len(distances)
    if not looked:
        return [True] * rays
    gaps = [(looked[-1], looked[0] + rays), *itertools.pairwise(looked)]
    before, after = max(gaps, key=lambda gap: gap[1] - gap[0])
    blind = {k % rays for k in range(before + 1, after)} if after - before > BLIND_FRACTION * rays else set()
    return [k not in blind for k in range(rays)]


def agreement(scan: Records, viewpoint: Vector, pose: RigidTransform, walls: Records) -> float:
    """Compare along each ray the first scan segment with the first wall."""
    distances, farthest = scan_distances(scan, viewpoint, RAYS)
    agree = against = 0
    for angle, distance, looked in zip(angles_of(RAYS), distances, in_view(distances), strict=True):
        towards = angle + pose.theta
        reach, w = first_hit(pose.apply(viewpoint), towards, max(FAR, FARTHER * farthest), walls)
        if not looked or w < 0:
            continue
        tolerance = AGREEING + AGREEING_FRACTION * distance
        if distance < math.inf:
            agree += bool(abs(distance - reach) < tolerance)
            against += bool(distance - reach >= tolerance)
        else:
            sine = abs(normal(walls[w]) @ [math.cos(towards), math.sin(towards)])
            near = reach < min(farthest, MISSING_RANGE)
            against += bool(near and walls[w]["end"] - walls[w]["begin"] > MISSING_LENGTH and sine > MISSING_SINE)
    return agree / (agree + against) if agree + against else NEUTRAL
