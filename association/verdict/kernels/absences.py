"""Weigh what a scan does not show at an alternative; see `association.verdict.inconsistencies`."""

import math

import numpy as np

from compiled import kernel
from registration.layout import Floats, Records

from ...consensus.kernels.beams import across_wall, evidence_of_beam, put_beam
from ...consensus.tuning import BEAMS_PASSED, BEAMS_READ, BEHIND, CERTAIN, LEAST_INCIDENCE
from ...tables import Place, Rays, Workspace
from ..tuning import LEAST_OF_BEAM


@kernel
def read_beams(
    rays: Rays, poses: Records, place: Place, obstacles: Place, work: Workspace, wider: float, readings: Floats
) -> None:
    """Write for each beam its part of the score at the first of the poses, nats, and where the map stops it, metres.

    `readings` (n, 2). The second is the range of the beam where it does not pass through a wall. The tolerances are
    `wider` times as wide as in the score.
    """
    beams = rays.beams
    walls = obstacles.walls
    pose = poses[0]
    ray = work.scratch[0].ray
    c = math.cos(pose.theta)
    s = math.sin(pose.theta)
    for i in range(len(beams)):
        readings[i, 0] = 0.0
        readings[i, 1] = beams[i].range
        if math.isinf(beams[i].range):
            continue
        put_beam(ray, beams[i], c, s, pose)
        ray.limit = min(rays.reach, beams[i].range + BEHIND)
        across, w = across_wall(ray, beams[i].range, place, obstacles)
        if w < 0:
            continue
        read, passed = evidence_of_beam(across / wider, walls[w])
        readings[i, 0] = (BEAMS_READ * read - BEAMS_PASSED * passed) / len(beams)
        if across > CERTAIN * wider:
            incidence = max(LEAST_INCIDENCE, abs(walls[w].dx * ray.dy - walls[w].dy * ray.dx))
            readings[i, 1] = beams[i].range - across / incidence


@kernel
def limit_by_things(rays: Rays, here: Floats, there: Floats, reach: float, limit: float) -> float:
    """Return what beams count against an alternative, nats, where each thing counts `limit` at most.

    `here` and `there` (n, 2) are what `read_beams` writes at the answer and at the alternative. Things are components
    of the places where beams differ, linked where they are within `reach` metres.
    """
    n = len(rays.beams)
    x = np.empty(n)
    y = np.empty(n)
    differs = np.zeros(n, np.bool_)
    for i in range(n):
        more = here[i, 0] - there[i, 0]
        distance = there[i, 1] if more > 0.0 else here[i, 1]
        differs[i] = abs(more) > LEAST_OF_BEAM
        x[i] = rays.beams[i].x + distance * rays.beams[i].dx
        y[i] = rays.beams[i].y + distance * rays.beams[i].dy
    waiting = np.empty(n, np.int64)
    total = 0.0
    for i in range(n):
        if not differs[i]:
            continue
        differs[i] = False
        waiting[0] = i
        filled = 1
        of_thing = 0.0
        while filled > 0:
            filled -= 1
            k = waiting[filled]
            of_thing += here[k, 0] - there[k, 0]
            for m in range(n):
                if differs[m] and math.hypot(x[m] - x[k], y[m] - y[k]) <= reach:
                    differs[m] = False
                    waiting[filled] = m
                    filled += 1
        total += max(0.0, min(of_thing, limit))
    return total
