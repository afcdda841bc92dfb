"""Twins of the kernels of lines of sight."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from association.consensus.tuning import (
    BLOCKED,
    BLOCKING_LENGTH,
    BLOCKING_RAYS,
    END_MARGIN,
    SIGHT_TOLERANCE,
)
from association.tuning import MAX_RAYS, RAY_SPACING
from registration import RigidTransform
from registration.layout import Record, Records

from .geometry import Vector, direction, normal, point

Counts = dict[int, list[int]]  # of each wall the rays to matched segments that pass through it, and of those to others


def first_hit(at: Vector, angle: float, limit: float, walls: Records) -> tuple[float, int]:
    """Cross the ray with all walls."""
    d = np.array([math.cos(angle), math.sin(angle)])
    across = normal(walls) @ d
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (walls["offset"] - normal(walls) @ at) / across
        along = direction(walls) @ at + reach * (direction(walls) @ d)
        met = (np.abs(across) > 1e-9) & (reach > 1e-6) & (walls["begin"] <= along) & (along <= walls["end"])
    reach = np.where(met, reach, math.inf)
    wall = int(reach.argmin())
    return (float(reach[wall]), wall) if reach[wall] < limit else (limit, -1)


def rays_to(segment: Record) -> list[np.ndarray]:
    """Return the points of a segment that rays are sent to: evenly spread, and none near the ends."""
    count = min(MAX_RAYS, max(1, math.ceil(segment["length"] / RAY_SPACING)))
    usable = max(0.0, segment["length"] - 2.0 * END_MARGIN)
    return [point(segment) + share * usable * direction(segment) for share in (np.arange(count) + 0.5) / count - 0.5]


def count_blockers(scan: Records, matched: Any, viewpoint: Vector, pose: RigidTransform, walls: Records) -> Counts:
    """Send the rays one by one."""
    counts: Counts = {}
    eye = pose.apply(viewpoint)
    for segment, on_wall in zip(scan, np.asarray(matched), strict=True):
        for end in rays_to(segment):
            gap = pose.apply(end) - eye
            distance = float(np.hypot(*gap))
            if distance > SIGHT_TOLERANCE:
                _, wall = first_hit(eye, math.atan2(gap[1], gap[0]), distance - SIGHT_TOLERANCE, walls)
                if wall >= 0:
                    counts.setdefault(wall, [0, 0])[0 if on_wall else 1] += 1
    return counts


def sight_penalty(counts: Counts, walls: Records) -> float:
    """Charge every wall by its length, and less where few rays pass."""
    total = 0.0
    for wall, (to_matched, to_clutter) in counts.items():
        length = min(BLOCKING_LENGTH, float(walls[wall]["end"] - walls[wall]["begin"]))
        total += length * BLOCKED * min(1.0, to_matched / BLOCKING_RAYS)
        total += length * BLOCKED * min(1.0, to_clutter / BLOCKING_RAYS)
    return total
