"""Weigh single beams: compare the expected readings of a laser at a pose with its readings."""

import math

from compiled import kernel
from registration.kernels import joint_add, joint_solve
from registration.layout import Record, Records

from ...tables import Place, Rays, Workspace
from ..tuning import (
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
from .pair_sums import clear_sums
from .scoring import add_spring
from .sight import first_hit


@kernel
def across_wall(ray: Record, distance: float, place: Place, obstacles: Place) -> tuple[float, int]:
    """Return how much farther than the map shows a beam reads, metres across the obstacle, and that; -1 for none.

    At a grazing angle the pose decides the range, so that it counts across the wall. A beam that passed a point is
    compared with the walls alone: an error of some centimetres suffices to pass one.
    """
    walls = obstacles.walls
    grid = obstacles.grid
    expected, w = first_hit(ray, walls, grid.starts, grid.items, grid.shape[0])
    if w >= len(place.walls) and distance - expected > CERTAIN:
        expected, w = first_hit(ray, place.walls, place.grid.starts, place.grid.items, place.grid.shape[0])
    if w < 0:
        return 0.0, w
    return (distance - expected) * max(LEAST_INCIDENCE, abs(walls[w].dx * ray.dy - walls[w].dy * ray.dx)), w


@kernel
def evidence_of_beam(across: float, wall: Record) -> tuple[float, float]:
    """Return how far a beam reads a wall, and how far it passed through it, 0 to 1, by its distance `across` it."""
    read = math.exp(-0.5 * across * across / (NEAR * NEAR))
    return read, min(1.0, (wall.end - wall.begin) / SURE_LENGTH) if across > CERTAIN else 0.0


@kernel
def put_beam(ray: Record, beam: Record, c: float, s: float, pose: Record) -> None:
    """Let a ray go where a beam did; `c` and `s` are cosine and sine of the pose's heading."""
    ray.x = c * beam.x - s * beam.y + pose.x
    ray.y = s * beam.x + c * beam.y + pose.y
    ray.dx = c * beam.dx - s * beam.dy
    ray.dy = s * beam.dx + c * beam.dy


@kernel
def beam_evidence(rays: Rays, pose: Record, place: Place, obstacles: Place, ray: Record, evidence: Record) -> None:
    """Write the fractions of the beams that read the wall they should, and that passed through one, to `evidence`.

    A beam that ends before the wall proves nothing: people and boxes stand in front of walls. One without a return
    proves little, black or mirror walls give none.
    """
    beams = rays.beams
    walls = obstacles.walls
    c = math.cos(pose.theta)
    s = math.sin(pose.theta)
    read = 0.0
    passed = 0.0
    for i in range(len(beams)):
        if math.isinf(beams[i].range):
            continue
        put_beam(ray, beams[i], c, s, pose)
        ray.limit = min(rays.reach, beams[i].range + BEHIND)
        across, w = across_wall(ray, beams[i].range, place, obstacles)
        if w < 0:
            continue
        here, through = evidence_of_beam(across, walls[w])
        read += here
        passed += through
    n = max(1, len(beams))
    evidence.read = read / n
    evidence.passed = passed / n


@kernel
def beam_fractions(
    rays: Rays, poses: Records, place: Place, obstacles: Place, work: Workspace
) -> tuple[float, float, float]:
    """Return the fractions of the beams that do not read what the map shows from the first pose, (1,).

    These are the fractions that read farther, and nearer; and that passed through a wall or a point, which a beam does
    in full at twice `NEAR` behind it, and not at all at `NEAR`. Beams without a return are not compared.
    """
    beams = rays.beams
    pose = poses[0]
    ray = work.scratch[0].ray
    c = math.cos(pose.theta)
    s = math.sin(pose.theta)
    farther = 0
    nearer = 0
    passed = 0.0
    for i in range(len(beams)):
        if math.isinf(beams[i].range):
            continue
        put_beam(ray, beams[i], c, s, pose)
        ray.limit = min(rays.reach, beams[i].range + WALL_BEHIND)
        across, w = across_wall(ray, beams[i].range, place, obstacles)
        if w < 0:
            continue
        passed += min(1.0, max(0.0, across / NEAR - 1.0))
        if across > FARTHER_BY and w < len(place.walls):
            farther += 1
        elif across < -NEAR:
            nearer += 1
    n = max(1, len(beams))
    return farther / n, nearer / n, passed / n


@kernel
def refine_by_beams(rays: Rays, pose: Record, place: Place, gate: float, work: Workspace) -> None:
    """Move `pose` to where the ends of the beams lie on the walls nearest to them, up to `gate` metres off.

    One round of point-to-line least squares by the same sums; a point is a pair without spread. A direction that no
    wall fixes is held where it is.
    """
    beams = rays.beams
    walls = place.walls
    starts = place.grid.starts
    items = place.grid.items
    shape = place.grid.shape[0]
    sums = work.scratch[0].sums
    point = work.scratch[0].point
    clear_sums(sums)
    c = math.cos(pose.theta)
    s = math.sin(pose.theta)
    for i in range(len(beams)):
        if math.isinf(beams[i].range):
            continue
        px = beams[i].x + beams[i].range * beams[i].dx
        py = beams[i].y + beams[i].range * beams[i].dy
        x = c * px - s * py + pose.x
        y = s * px + c * py + pose.y
        fx = (x - shape.x0) / shape.cell
        fy = (y - shape.y0) / shape.cell
        if not (fx >= 0.0 and fy >= 0.0 and fx < shape.columns and fy < shape.rows):
            continue
        here = int(fy) * shape.columns + int(fx)
        nearest = -1
        least = gate
        for k in range(starts[here], starts[here + 1]):
            w = items[k]
            along = walls[w].dx * x + walls[w].dy * y
            off = abs(walls[w].dx * y - walls[w].dy * x - walls[w].offset)
            if off < least and along >= walls[w].begin - NEAR and along <= walls[w].end + NEAR:
                least = off
                nearest = w
        if nearest >= 0:
            point.centroid_x = px
            point.centroid_y = py
            joint_add(sums, walls[nearest], point, 1.0, 1.0)
    if sums.count < LEAST_POINTS:
        return
    add_spring(sums, pose.x, pose.y, 1.0)
    theta, tx, ty, _, _ = joint_solve(sums, pose.theta, False)
    pose.theta = theta
    pose.x = tx
    pose.y = ty


@kernel
def weigh_beams(
    rays: Rays, poses: Records, place: Place, obstacles: Place, refined: int, work: Workspace, out: Records
) -> None:
    """Write the evidence of the beams at each of the poses (k,) to `out` (k,) of `BEAM_EVIDENCE`.

    The first `refined` poses are moved to where the beams fit best, if they fit better there.
    """
    moved = work.scratch[0].estimate
    evidence = work.scratch[0].evidence
    for k in range(len(poses)):
        beam_evidence(rays, poses[k], place, obstacles, work.scratch[0].ray, out[k])
        if k < refined:
            moved.theta = poses[k].theta
            moved.x = poses[k].x
            moved.y = poses[k].y
            for gate in BEAM_GATES:
                refine_by_beams(rays, moved, place, gate, work)
            beam_evidence(rays, moved, place, obstacles, work.scratch[0].ray, evidence)
            if evidence.read > out[k].read and evidence.passed <= out[k].passed + PASSED_SLACK:
                out[k].read = evidence.read
                out[k].passed = evidence.passed
                poses[k].theta = moved.theta
                poses[k].x = moved.x
                poses[k].y = moved.y
