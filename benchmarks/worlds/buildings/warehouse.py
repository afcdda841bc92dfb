"""Warehouses: racks full of goods, and racks of which a laser near the floor sees the legs alone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .plan import Building, Plan
from .shapes import box, oblong

GUARD = 0.25  # m; what protects a rack's end from forklifts
GATE = (3.2, 0.5)  # m; width and depth of a loading gate's recess
OFFICE = (7.0, 4.5)  # m


@dataclass(frozen=True, slots=True)
class Racks:
    """The arrangement of racks in a hall; lengths in metres.

    Attributes
    ----------
    bay, depth : float
        From frame to frame, and of one rack; two stand back to back.
    flue : float
        Between those two.
    aisle : float
        Between double rows.
    post : float
        Width of a frame.
    rows, bays : (int, int)
        Least and greatest number of double rows, and of bays in a block.
    """

    bay: float = 2.7
    depth: float = 1.1
    flue: float = 0.2
    aisle: float = 3.0
    post: float = 0.1
    rows: tuple[int, int] = (3, 5)
    bays: tuple[int, int] = (5, 8)

    @classmethod
    def draw(cls, rng: np.random.Generator, rows: tuple[int, int], bays: tuple[int, int]) -> Racks:
        """Draw the dimensions that one firm has in all its halls."""
        bay = float(rng.choice([1.85, 2.7, 2.7, 3.6]))
        return cls(bay, rng.uniform(1.0, 1.2), rng.uniform(0.15, 0.3), rng.uniform(2.6, 3.6), 0.1, rows, bays)


@dataclass(frozen=True, slots=True)
class Warehouse:
    """A hall of double rows of racks with goods down to the floor.

    Attributes
    ----------
    racks : Racks
    full : float
        Share of the bays that hold a load.
    tidy : bool
        True if all loads are of one size and stand in line.
    """

    racks: Racks
    full: float
    tidy: bool

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Warehouse:
        """Draw a style."""
        tidy = bool(rng.random() < 0.5)
        return cls(Racks.draw(rng, (3, 4), (5, 7)), rng.uniform(0.9, 1.0) if tidy else rng.uniform(0.7, 0.95), tidy)

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a hall: how many racks, which bays are full, where the gates are."""
        plan, racks = Plan(), self.racks
        for rack, bays in _hall(plan, racks, rng):
            for k in range(bays + 1):
                rack.block(box(k * racks.bay, 0.0, k * racks.bay + racks.post, racks.depth))
            for k in range(bays):
                if rng.random() < self.full:
                    width = (racks.bay - racks.post) * (0.9 if self.tidy else rng.uniform(0.75, 0.97))
                    middle = k * racks.bay + 0.5 * (racks.bay + racks.post)
                    front = 0.5 * racks.depth - (0.05 if self.tidy else rng.uniform(-0.05, 0.12))
                    rack.thing("load", oblong(middle, front, width, racks.depth - 0.15))
        return plan.building("warehouse")


@dataclass(frozen=True, slots=True)
class RackLegs:
    """A hall of racks whose lowest shelf is above the laser: posts two by two, and some pallets on the floor.

    Attributes
    ----------
    racks : Racks
    pallets : float
        Share of the bays that have a pallet on the floor.
    """

    racks: Racks
    pallets: float

    @classmethod
    def draw(cls, rng: np.random.Generator) -> RackLegs:
        """Draw a style."""
        return cls(Racks.draw(rng, (2, 4), (5, 9)), float(rng.choice([0.0, 0.03, 0.12])))

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a hall: how many racks, where pallets stand and gates are."""
        plan, racks = Plan(), self.racks
        for rack, bays in _hall(plan, racks, rng):
            for k in range(bays + 1):
                x = k * racks.bay + 0.5 * racks.post
                for y in (0.5 * racks.post, racks.depth - 0.5 * racks.post):
                    rack.block(oblong(x, y, racks.post, racks.post))
            for bay in np.flatnonzero(rng.random(bays) < self.pallets):
                x = (bay + 0.5) * racks.bay + rng.uniform(-0.2, 0.2)
                rack.thing("pallet", oblong(x, 0.5 * racks.depth, 1.2, 0.8, rng.normal(0.0, 0.05)))
        return plan.building("rack_legs")


def _hall(plan: Plan, racks: Racks, rng: np.random.Generator) -> Iterator[tuple[Plan, int]]:
    """Draw a hall with its gates and office; yield each rack's part of the plan, its front along x, and its bays."""
    rows = int(rng.integers(racks.rows[0], racks.rows[1] + 1))
    blocks = [int(n) for n in rng.integers(racks.bays[0], racks.bays[1] + 1, 2)]
    cross, left, right = rng.uniform(3.0, 5.0), rng.uniform(7.5, 11.0), rng.uniform(3.0, 5.0)
    double = 2.0 * racks.depth + racks.flue
    width = rows * double + (rows + 1) * racks.aisle
    length = left + sum(blocks) * racks.bay + 2.0 * racks.post + cross + right
    plan.room(box(0.0, 0.0, length, width))
    _gates(plan, width, rng)
    _office(plan, length, rng)
    for row in range(rows):
        y = racks.aisle + row * (double + racks.aisle)
        x = left
        for bays in blocks:
            # A row may be shorter than its neighbours: fire doors, columns, an earlier tenant.
            missing = int(rng.integers(0, 3)) if rng.random() < 0.4 else 0
            end = x + (bays - missing) * racks.bay + racks.post
            yield plan.at(x, y), bays - missing
            yield plan.at(end, y + double, math.pi), bays - missing
            for side in (x - 2.0 * GUARD, end + GUARD):
                plan.block(box(side, y + 0.1, side + 0.5 * GUARD, y + double - 0.1))
            x += bays * racks.bay + racks.post + cross


def _gates(plan: Plan, width: float, rng: np.random.Generator) -> None:
    """Set loading gates into the left wall, which runs downwards."""
    y = rng.uniform(1.0, 3.0)
    while y + GATE[0] < width - 1.0:
        if rng.random() < 0.75:
            plan.recess((0.0, y + GATE[0]), (0.0, y), GATE[1])
        y += GATE[0] + rng.choice([1.3, 2.6])


def _office(plan: Plan, length: float, rng: np.random.Generator) -> None:
    """Put the foreman's office behind the lower wall, where a door leads to it."""
    x = rng.uniform(1.0, length - OFFICE[0] - 1.0)
    plan.room(box(x, -0.2 - OFFICE[1], x + OFFICE[0], -0.2))
    door = x + rng.uniform(0.5, OFFICE[0] - 1.6)
    plan.opening((door, 0.0), (door + 1.0, 0.0), 0.2, door=True)
    plan.thing("desk", oblong(x + 0.5 * OFFICE[0], -0.2 - 0.7 * OFFICE[1], 1.8, 0.8))
