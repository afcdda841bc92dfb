"""Visits of a robot to a building that has changed since its map was made."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from association import mirrored
from linefix import scan_of
from map_quality import VisitScan
from registration import IDENTITY, RigidTransform, Segments
from simulation import FAMILIES, Building, Scanner, SimulationError, free_place, scan
from simulation.changes import clutter, rearranged, with_doors
from vectorization import LaserScan

SCANNER = Scanner.over(math.tau, 720, range_max=20.0, sigma=0.02)
CLUTTER = 0.1  # of the beams end on people and pallets
OWN_ERROR = (0.2, 0.2, 0.1)  # m, m, rad; of poses that a robot sends
ODOMETRY_ERROR = (0.05, 0.01, 0.02)  # m for each metre, rad for each metre, rad for each radian
AWAY = 0.4  # m; of a place from that of the visit before


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """A building on the day of its map, and today; and the places where the robot comes by on each visit."""

    family: str
    mapped: Building
    today: Building
    places: tuple[RigidTransform, ...]


def draw(family: str, seed: int, places: int, share: float = 0.2) -> Scene:
    """Draw a building, and its state of today: a share of what can move is moved or gone, of the doors shut."""
    rng = np.random.default_rng((seed, list(FAMILIES).index(family)))
    mapped = FAMILIES[family].draw(rng).build(rng)
    today = rearranged(mapped, rng, share) if share else mapped
    return Scene(family, mapped, today, tuple(free_place(today.segments, rng) for _ in range(places)))


def visits(
    scene: Scene, count: int, rng: np.random.Generator, scanner: Scanner = SCANNER, *, doors: bool = False
) -> Iterator[tuple[VisitScan, RigidTransform]]:
    """Yield the scans of so many visits with their true poses; people stand elsewhere at each, doors anyhow."""
    for number in range(count):
        today = with_doors(scene.today, rng).segments if doors else scene.today.segments
        for place in scene.places:
            at = _near(today, place, rng)
            yield VisitScan(take(today, at, rng, scanner), f"visit {number}"), at


def _near(walls: Segments, place: RigidTransform, rng: np.random.Generator) -> RigidTransform:
    """Return a free pose near a place; the place itself where there is none."""
    for _ in range(20):
        x, y = place.x + rng.uniform(-AWAY, AWAY), place.y + rng.uniform(-AWAY, AWAY)
        off = walls.midpoints - [x, y]
        along = np.clip(-np.einsum("ij,ij->i", off, walls.directions), -0.5 * walls.lengths, 0.5 * walls.lengths)
        gaps = np.linalg.norm(off + along[:, None] * walls.directions, axis=1)
        if gaps.min() > 0.3:
            return RigidTransform(float(x), float(y), rng.uniform(-math.pi, math.pi))
    return place


def take(walls: Segments, at: RigidTransform, rng: np.random.Generator, scanner: Scanner = SCANNER):  # type: ignore[no-untyped-def]
    """Return a scan among people and pallets."""
    objects = clutter(walls, at, scanner, CLUTTER, rng)
    if objects is not None:
        walls = Segments.from_array(np.vstack([walls.endpoints, objects[0]]))
    seen = scan(walls, at, scanner, rng)
    return scan_of(LaserScan(scanner.angle_min, scanner.angle_increment, seen.ranges, 0.0, scanner.range_max))


def with_poses(taken: Sequence[tuple[VisitScan, RigidTransform]], rng: np.random.Generator) -> list[VisitScan]:
    """Return scans with poses of the robot's own, which are off as that of a robot that tracks its pose."""
    covariance = np.diag(np.square(OWN_ERROR))
    out = []
    for one, at in taken:
        x, y, theta = rng.normal(0.0, OWN_ERROR)
        out.append(replace(one, pose=RigidTransform(at.x + x, at.y + y, at.theta + theta), covariance=covariance))
    return out


def routed(scene: Scene) -> Scene:
    """Return a scene with its places in the order of a route: the nearest of those left comes next."""
    left = list(scene.places)
    route = [left.pop(0)]
    while left:
        gaps = [math.hypot(one.x - route[-1].x, one.y - route[-1].y) for one in left]
        route.append(left.pop(int(np.argmin(gaps))))
    return replace(scene, places=tuple(route))


def with_odometry(taken: Sequence[tuple[VisitScan, RigidTransform]], rng: np.random.Generator) -> list[VisitScan]:
    """Return scans with odometry, which starts at zero in each visit, and whose error grows with the distance."""
    out: list[VisitScan] = []
    last, here = taken[0][1], IDENTITY
    for number, (one, at) in enumerate(taken):
        if number and one.visit != taken[number - 1][0].visit:
            last, here = at, IDENTITY
        step = last.inverse().compose(at)
        way, (slip, bend, turn) = math.hypot(step.x, step.y), ODOMETRY_ERROR
        x, y = rng.normal(0.0, slip * way, 2)
        theta = rng.normal(0.0, math.hypot(bend * way, turn * step.theta))
        here, last = here.compose(RigidTransform(step.x + x, step.y + y, step.theta + theta)), at
        out.append(replace(one, odometry=here))
    return out


def flipped(scans: Sequence[VisitScan]) -> list[VisitScan]:
    """Return scans as of a laser that is mounted upside down."""
    return [replace(one, scan=mirrored(one.scan)) for one in scans]


def off_scale(scans: Sequence[VisitScan], factor: float) -> list[VisitScan]:
    """Return scans of which all ranges are multiplied."""
    from association.scan.scan import scaled

    return [replace(one, scan=scaled(one.scan, factor)) for one in scans]


def drawn(families: Sequence[str], seeds: Sequence[int], places: int, share: float = 0.2) -> Iterator[Scene]:
    """Yield scenes of some families; those that have no free places are left out."""
    for family in families:
        for seed in seeds:
            try:
                yield draw(family, seed, places, share)
            except SimulationError:
                continue
