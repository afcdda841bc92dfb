"""Drawn worlds in which several poses explain a scan about as well: a correct answer is ambiguous, and lists the truth.

Scans are simulated with 2 cm noise from random poses and vectorized. A scene passes where every answer is `ambiguous`
or `degenerate` and the truth is the pose or one of the alternatives; where a direction is not fixed, up to a shift
along it.

``python -m benchmarks.lookalikes [--seeds 10]``
"""

from __future__ import annotations

import argparse
import math
from collections import Counter
from dataclasses import dataclass

import numpy as np

from association import AssociationOptions, AssociationResult, MapIndex, Scan, Status, associate
from registration import RigidTransform, Segments, wrap_angle
from simulation import corridor, rectangle_room, square_room

from .drawn import SCANNER, take_scan
from .outcomes import progress
from .table import Row, mean, print_rows

OPTIONS = AssociationOptions(max_alternatives=50)
DISTANCE = 0.1  # m
ANGLE = 1.0  # degrees
CLEARANCE = 0.5  # m between a pose and the nearest wall
PILLAR = 0.5  # m
GRID_SPACING = 3.0  # m
L_ROOM = ((0.0, 0.0), (6.0, 0.0), (6.0, 3.0), (3.5, 3.0), (3.5, 5.0), (0.0, 5.0))

Corners = tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True)
class Scene:
    """A world with similar places.

    Attributes
    ----------
    name : str
    segments : Segments
    places : (low corner, high corner)
        If poses are drawn; those too near a wall or outside are drawn again.
    """

    name: str
    segments: Segments
    places: tuple[tuple[float, float], tuple[float, float]]


def scenes() -> list[Scene]:
    """Return all worlds."""
    rooms = [_equal_rooms(count) for count in range(2, 9)]
    simple = [
        Scene("square room", square_room(6.0).segments, ((-3.0, -3.0), (3.0, 3.0))),
        Scene("rectangular room", rectangle_room(8.0, 5.0).segments, ((-4.0, -2.5), (4.0, 2.5))),
        Scene("long open corridor", corridor(80.0, 2.0).segments, ((-15.0, -1.0), (15.0, 1.0))),
        Scene("long closed corridor, middle", rectangle_room(80.0, 2.0).segments, ((-15.0, -1.0), (15.0, 1.0))),
        Scene("long closed corridor, end", rectangle_room(80.0, 2.0).segments, ((30.0, -1.0), (40.0, 1.0))),
        Scene("corridor with equal doors", _corridor_with_doors(), ((-10.0, -1.0), (10.0, 1.0))),
    ]
    return [*rooms, *simple, _pillar_grid(3), _pillar_grid(5), _mirrored_wings()]


def _outline(corners: Corners) -> np.ndarray:
    p = np.asarray(corners)
    return np.hstack([p, np.roll(p, -1, axis=0)])


def _equal_rooms(count: int) -> Scene:
    """Return L-shaped rooms in a row, every other one turned; each alone would give one pose."""
    pieces = []
    for k in range(count):
        place = RigidTransform(8.0 * k + (6.0 if k % 2 else 0.0), 5.0 if k % 2 else 0.0, math.pi if k % 2 else 0.0)
        pieces.append(place.apply(_outline(L_ROOM).reshape(-1, 2, 2)).reshape(-1, 4))
    return Scene(f"{count} equal rooms", Segments.from_array(np.vstack(pieces)), ((0.0, 0.0), (8.0 * count - 2.0, 5.0)))


def _corridor_with_doors() -> Segments:
    """Return a corridor of 80 m whose walls have an opening of 1 m every 4 m, ends out of sight."""
    walls = []
    for k in range(-10, 10):
        walls += [[4.0 * k, -1.0, 4.0 * k + 3.0, -1.0], [4.0 * k + 3.0, 1.0, 4.0 * k, 1.0]]
    return Segments.from_array(walls)


def _pillar_grid(count: int) -> Scene:
    """Return count by count square pillars with nothing around them."""
    half, extent = 0.5 * PILLAR, GRID_SPACING * (count - 1)
    pillar = _outline(((-half, -half), (-half, half), (half, half), (half, -half)))
    pieces = [pillar + np.tile([GRID_SPACING * i, GRID_SPACING * k], 2) for i in range(count) for k in range(count)]
    return Scene(
        f"grid of {count} x {count} pillars", Segments.from_array(np.vstack(pieces)), ((0.0, 0.0), (extent,) * 2)
    )


def _mirrored_wings() -> Scene:
    """Return a corridor between rooms of several widths, mirrored across both axes: half a turn changes nothing."""
    widths, depth, door = (3.0, 4.5, 3.5, 5.0), 4.0, 0.5
    quarter, x = [], 0.0
    for width in widths:
        middle = x + 0.5 * width
        quarter += [
            [x, 1.0, middle - door, 1.0], [middle + door, 1.0, x + width, 1.0], [x + 0.1, 1.1, middle - door, 1.1],
            [middle + door, 1.1, x + width - 0.1, 1.1], [x + width - 0.1, 1.1, x + width - 0.1, 1.1 + depth],
            [x + width - 0.1, 1.1 + depth, x + 0.1, 1.1 + depth], [x + 0.1, 1.1 + depth, x + 0.1, 1.1],
        ]  # fmt: skip
        for wall in (0, 1):
            quarter[-7 + wall] = [quarter[-7 + wall][k] for k in (2, 3, 0, 1)]  # the corridor lies below these
        x += width
    quarter.append([x, 0.0, x, 1.0])
    upper_right = np.array(quarter)
    upper = np.vstack([upper_right, (upper_right * [-1, 1, -1, 1])[:, [2, 3, 0, 1]]])
    whole = np.vstack([upper, (upper * [1, -1, 1, -1])[:, [2, 3, 0, 1]]])
    return Scene("mirrored wings", Segments.from_array(whole), ((-x, -5.0), (x, 5.0)))


def draw_pose(scene: Scene, rng: np.random.Generator) -> RigidTransform:
    """Draw a pose in free space: off the walls, the nearest of which shows its left."""
    s = scene.segments
    while True:
        p = rng.uniform(*scene.places)
        along = np.clip(np.einsum("ij,ij->i", p - s.endpoints[:, :2], s.directions), 0.0, s.lengths)
        gaps = np.linalg.norm(s.endpoints[:, :2] + along[:, None] * s.directions - p, axis=1)
        nearest = np.flatnonzero(gaps < gaps.min() + 1e-6)
        left = np.einsum("ij,ij->i", p - s.endpoints[nearest, :2], s.normals[nearest]) > 0.0
        if gaps.min() > CLEARANCE and left.any():
            return RigidTransform(p[0], p[1], rng.uniform(-math.pi, math.pi))


def lists_truth(result: AssociationResult, truth: RigidTransform) -> bool:
    """Tell whether the truth is the pose or an alternative, up to a shift along what the answer says is not fixed."""
    free = np.array(result.unobservable) if result.unobservable else np.zeros(2)
    for pose in [result.pose, *(a.pose for a in result.alternatives)]:
        if pose is not None and abs(math.degrees(wrap_angle(pose.theta - truth.theta))) < ANGLE:
            gap = np.array([pose.x - truth.x, pose.y - truth.y])
            if np.linalg.norm(gap - (gap @ free) * free) < DISTANCE:
                return True
    return False


def try_scene(scene: Scene, seeds: int) -> Row:
    """Scan a scene once a seed, and judge the answers."""
    index = MapIndex.build(scene.segments)
    statuses: Counter[str] = Counter()
    sure, unlisted = [], []
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        pose = draw_pose(scene, rng)
        measured, _ = take_scan(scene.segments, pose, rng, SCANNER)
        result = associate(index, Scan(measured), None, OPTIONS)
        statuses[str(result.status)] += 1
        if result.status not in (Status.AMBIGUOUS, Status.DEGENERATE):
            sure.append(seed)
        elif not lists_truth(result, pose):
            unlisted.append(seed)
        progress(scene.name, seed + 1, seeds)
    told = ", ".join(f"{count} {status}" for status, count in sorted(statuses.items()))
    failing = [f"other status: seeds {sure}"] * bool(sure) + [f"truth not listed: seeds {unlisted}"] * bool(unlisted)
    good = seeds - len(sure) - len(unlisted)
    return Row(scene.name, "; ".join([f"{good} of {seeds}", told, *failing]), "", None, "all", good == seeds)


def lookalikes(seeds: int) -> list[Row]:
    """Return a row a scene and one for all."""
    rows = [try_scene(scene, seeds) for scene in scenes()]
    share = mean(row.aimed for row in rows if row.aimed is not None)
    return [*rows, Row("look-alikes: scenes without fault", f"{share:.2f}", "", None, "all", share == 1.0)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10, help="scans a scene")
    print_rows("Look-alikes", lookalikes(parser.parse_args().seeds))


if __name__ == "__main__":
    main()
