"""A building on another day than that of its map: things moved or gone, doors, and objects that are in no map."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from registration import RigidTransform, Segments
from simulation import Scanner
from simulation.kernels.casting import cast

from .buildings.plan import FIXED, Building
from .buildings.shapes import box, crosses, edges, oblong, ring, turned

Floats = NDArray[np.float64]

MOVED = (0.3, 1.5)  # m; how far a thing is moved,
TURNED = 0.5  # rad; and how far at most it is turned
LEAF = 0.04  # m; thickness of a door's leaf
AJAR = (math.radians(60.0), math.radians(110.0))  # how far an open leaf stands open
TRIES = 8  # to find room for a thing that is moved; else it is gone

PERSON = 0.22  # m; radius
PALLET = (1.2, 0.8)  # m
NEAREST, FARTHEST = 0.7, 9.0  # m; where clutter stands
TOLERANCE = 0.03  # by which the share of beams on clutter may be missed
ATTEMPTS = 600


def rearranged(building: Building, rng: np.random.Generator, share: float = 0.2) -> Building:
    """Return a building of whose movable things a share is moved, half of it, or gone, and as many doors are shut.

    Parameters
    ----------
    building : Building
    rng : numpy.random.Generator
    share : float
        From 0 to 1, rounded to whole things and doors.
    """
    count = len(building.kinds)
    touched = rng.permutation(count)[: round(share * count)]
    gone = set(touched[: len(touched) // 2].tolist())
    moved = set(touched[len(touched) // 2 :].tolist())
    standing = building.segments.endpoints[~np.isin(building.things, touched)]
    outlines = [(FIXED, building.fixed.endpoints)]
    for thing in range(count):
        if thing in gone:
            continue
        outline = building.segments.endpoints[building.things == thing]
        if thing in moved:
            found = _moved(outline, standing, rng)
            if found is None:
                continue
            outline = found
            standing = np.vstack([standing, outline])
        outlines.append((thing, outline))
    shut = rng.permutation(len(building.doors))[: round(share * len(building.doors))]
    return _with_leaves(_rebuilt(building, outlines), [_leaf(building.doors[k], 0.0) for k in sorted(shut.tolist())])


def with_doors(building: Building, rng: np.random.Generator, shut: float = 0.5) -> Building:
    """Return a building with a leaf in every doorway: a share of them shut, the others open and in sight."""
    angles = np.where(rng.random(len(building.doors)) < shut, 0.0, rng.uniform(*AJAR, len(building.doors)))
    return _with_leaves(building, [_leaf(door, float(a)) for door, a in zip(building.doors, angles, strict=True)])


def clutter(
    standing: Segments, pose: RigidTransform, scanner: Scanner, share: float, rng: np.random.Generator
) -> tuple[Floats, float] | None:
    """Put people and pallets about a scanner, until so many of its beams end on them.

    Parameters
    ----------
    standing : Segments
        The segments that are already there, metres.
    pose : RigidTransform
        Of the scanner, in the frame of `standing`.
    scanner : Scanner
    share : float
        Of all beams, 0 to 1; reached within 0.03.
    rng : numpy.random.Generator

    Returns
    -------
    (k, 4) their outlines, metres
    float
        The share that was reached.

    Nothing is returned where there is no room for so many.
    """
    angles = scanner.angles + pose.theta
    behind = np.minimum(_ranges(standing.endpoints, pose, scanner), scanner.range_max)
    outlines, reached, nearest = np.zeros((0, 4)), 0.0, np.full(scanner.beams, np.inf)
    for _ in range(ATTEMPTS):
        if reached >= share - TOLERANCE:
            return outlines, reached
        beam = int(rng.integers(scanner.beams))
        free = float(min(behind[beam], nearest[beam], FARTHEST))
        if free < NEAREST + 2.0 * PERSON:
            continue
        distance = rng.uniform(NEAREST, free - PERSON)
        x, y = pose.x + distance * math.cos(angles[beam]), pose.y + distance * math.sin(angles[beam])
        if rng.random() < 0.7 or distance < 1.5:
            corners = ring(x, y, PERSON, 6, rng.uniform(0.0, 1.0))
        else:
            corners = oblong(x, y, *PALLET, rng.uniform(0.0, math.pi))
        outline = edges(corners[::-1])
        if crosses(outline, standing.endpoints) or crosses(outline, outlines):
            continue
        closer = np.minimum(nearest, _ranges(outline, pose, scanner))
        hidden = float((closer < behind).mean())
        if hidden <= share + TOLERANCE:
            outlines, nearest, reached = np.vstack([outlines, outline]), closer, hidden
    return None


def _ranges(walls: Floats, pose: RigidTransform, scanner: Scanner) -> Floats:
    """Return how far each beam is free, ``(m,)`` metres."""
    angles = scanner.angles + pose.theta
    ranges: Floats = cast(
        walls, pose.x, pose.y, angles[0], scanner.angle_increment, np.cos(angles), np.sin(angles), False
    )[0]
    return ranges


def _moved(outline: Floats, standing: Floats, rng: np.random.Generator) -> Floats | None:
    """Return an outline shifted and turned to where nothing stands; None where no such place was found."""
    middle = outline[:, :2].mean(axis=0)
    for _ in range(TRIES):
        away, bearing = rng.uniform(*MOVED), rng.uniform(0.0, math.tau)
        x, y = middle + away * np.array([math.cos(bearing), math.sin(bearing)])
        corners = turned(outline.reshape(-1, 2) - middle, x, y, rng.uniform(-TURNED, TURNED))
        found = corners.reshape(-1, 4)
        if not crosses(found, standing):
            return found
    return None


def _leaf(door: Floats, open_by: float) -> Floats:
    """Return the outline of a door's leaf that stands open by an angle."""
    along = door[2:] - door[:2]
    turn = math.atan2(along[1], along[0]) + open_by
    return edges(turned(box(0.0, -LEAF, math.hypot(*along), 0.0), float(door[0]), float(door[1]), turn)[::-1])


def _with_leaves(building: Building, leaves: list[Floats]) -> Building:
    """Return the building with these leaves as things more."""
    things = [(k, building.segments.endpoints[building.things == k]) for k in range(len(building.kinds))]
    first = len(building.kinds)
    outlines = [(FIXED, building.fixed.endpoints), *things, *((first + k, leaf) for k, leaf in enumerate(leaves))]
    return _rebuilt(replace(building, kinds=(*building.kinds, *["door"] * len(leaves))), outlines)


def _rebuilt(building: Building, outlines: list[tuple[int, Floats]]) -> Building:
    """Return a building of these outlines, each of a thing or of what is fixed; things without one are gone."""
    kept = sorted({thing for thing, _ in outlines if thing != FIXED})
    number = {thing: k for k, thing in enumerate(kept)} | {FIXED: FIXED}
    return replace(
        building,
        segments=Segments.from_array(np.vstack([sides for _, sides in outlines])),
        things=np.concatenate([np.full(len(sides), number[thing]) for thing, sides in outlines]),
        kinds=tuple(building.kinds[thing] for thing in kept),
    )
