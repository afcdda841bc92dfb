"""Scans of drawn worlds, and the collection that stands in where there is no data folder."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from registration import MeasuredSegments, RigidTransform, Segments
from simulation import OfficePlan, Scanner, World, offices, scan, with_obstacles
from vectorization import LaserScan, Vectorization, VectorizationOptions, vectorize

from .collection import LEVELS, SIGMA, Collection, Query

SCANNER = Scanner(sigma=SIGMA)
CLUTTER = {"scan": 0.0, "scan_30": 0.3, "scan_50": 0.5}
NEAR = 12.0  # m; unmapped obstacles are put within this distance of the scanner
FAMILY = "drawn_offices"


def take_scan(
    segments: Segments, pose: RigidTransform, rng: np.random.Generator, scanner: Scanner = SCANNER
) -> tuple[MeasuredSegments, np.ndarray]:
    """Scan and vectorize; return the segments and for each the map segment that most of its points lie on, or -1."""
    seen = scan(segments, pose, scanner, rng)
    laser = LaserScan(scanner.angle_min, scanner.angle_increment, seen.ranges, scanner.range_min, scanner.range_max)
    found = vectorize(laser, VectorizationOptions(sigma=scanner.sigma))
    return found.measured, _walls(found, seen.hits)


def _walls(found: Vectorization, hits: np.ndarray) -> np.ndarray:
    walls = np.full(len(found.measured), -1)
    for k, (first, last) in enumerate(found.spans):
        beams = np.arange(first, last + 1) if first <= last else np.r_[first : len(hits), 0 : last + 1]
        seen = hits[beams]
        seen = seen[seen >= 0]
        if len(seen):
            walls[k] = np.bincount(seen).argmax()
    return walls


def nearby(segments: Segments, pose: RigidTransform, distance: float) -> Segments:
    """Return the segments that come within a distance of a pose, in their order."""
    begin = segments.endpoints[:, :2] - [pose.x, pose.y]
    along = np.clip(-np.einsum("ij,ij->i", begin, segments.directions), 0.0, segments.lengths)
    gaps = np.linalg.norm(begin + along[:, None] * segments.directions, axis=1)
    return segments.take(np.flatnonzero(gaps < distance))


def cluttered_scan(
    segments: Segments, pose: RigidTransform, share: float, rng: np.random.Generator
) -> tuple[Segments, np.ndarray]:
    """Scan among unmapped boxes, as few as make `share` of the scan's segments theirs.

    Returns
    -------
    Segments
        In the scan frame, shuffled.
    (n,) whether each is on the map
    """
    inner = nearby(segments, pose, NEAR)
    outer = nearby(segments, pose, SCANNER.range_max)
    room = World("near", inner, (pose,), len(inner))
    boxes = 0
    while True:
        extra = with_obstacles(room, boxes, rng).segments.endpoints[len(inner) :] if boxes else np.zeros((0, 4))
        everything = Segments.from_array(np.vstack([outer.endpoints, extra]))
        measured, walls = take_scan(everything, pose, rng)
        mapped = walls < len(outer)
        if boxes >= 256 or (len(mapped) and np.mean(~mapped) >= share) or (share == 0.0):
            order = rng.permutation(len(measured))
            return measured.segments.take(order), mapped[order]
        boxes = max(2, math.ceil(1.4 * boxes))


def campus_of_offices(rng: np.random.Generator, floors: int, plan: OfficePlan | None = None) -> World:
    """Tile drawn floors in a row, 5 m apart."""
    pieces, poses, left = [], [], 0.0
    for _ in range(floors):
        floor = offices(rng, plan)
        shift = left - floor.segments.endpoints[:, [0, 2]].min()
        pieces.append(floor.segments.shifted([shift, 0.0]).endpoints)
        poses += [replace(p, x=p.x + shift) for p in floor.poses]
        left = float(pieces[-1][:, [0, 2]].max()) + 5.0
    segments = Segments.from_array(np.vstack(pieces))
    return World("campus", segments, tuple(poses), len(segments))


def drawn_offices(count: int, seed: int = 20190901) -> Collection:
    """Draw `count` poses in tiled offices, each with scans of the three levels of clutter."""
    rng = np.random.default_rng(seed)
    worlds = {(FAMILY, f"campus-{k}"): campus_of_offices(rng, 1 + k % 4) for k in range(8)}
    queries = []
    for number in range(count):
        key = (FAMILY, f"campus-{number % len(worlds)}")
        poses = worlds[key].poses
        centre = poses[rng.integers(len(poses))]
        shift = rng.uniform(-0.5, 0.5, 2)
        pose = RigidTransform(centre.x + shift[0], centre.y + shift[1], rng.uniform(-math.pi, math.pi))
        for level in LEVELS:
            segments, _ = cluttered_scan(worlds[key].segments, pose, CLUTTER[level], rng)
            queries.append(Query(*key, number, level, pose, segments))
    maps = {key: world.segments for key, world in worlds.items()}
    return Collection("drawn offices", maps, tuple(queries), distance=0.1, angle=1.0)
