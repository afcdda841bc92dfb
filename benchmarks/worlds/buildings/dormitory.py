"""Dormitories: corridors of equal rooms, none of them mirrored, in which people move the furniture."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .corridors import corridor, door, rooms_along
from .plan import Building, Plan
from .shapes import box, oblong

WALL = 0.15  # m
DOOR = 0.88  # m


@dataclass(frozen=True, slots=True)
class Dormitory:
    """A floor of a dormitory; lengths in metres.

    Attributes
    ----------
    module, depth : float
        Of a room, along the corridor and away from it.
    corridor : float
        Its width.
    shaft : (float, float)
        Of the shaft that each room has next to its door, along the corridor and into the room.
    bed, desk : (float, float)
        Length and width.
    kitchen : int
        Number of modules of the common room at the end of the corridor.
    tidy : bool
        True if the furniture stands alike in all rooms.
    """

    module: float
    depth: float
    corridor: float
    shaft: tuple[float, float]
    bed: tuple[float, float]
    desk: tuple[float, float]
    kitchen: int
    tidy: bool

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Dormitory:
        """Draw a style."""
        return cls(
            module=rng.uniform(2.9, 3.8),
            depth=rng.uniform(4.4, 6.0),
            corridor=rng.uniform(1.5, 2.3),
            shaft=(rng.uniform(0.5, 0.9), rng.uniform(0.5, 1.3)),
            bed=(2.0, float(rng.choice([0.8, 0.9, 1.0]))),
            desk=(rng.uniform(1.2, 1.6), rng.uniform(0.6, 0.8)),
            kitchen=int(rng.integers(1, 3)),
            tidy=bool(rng.random() < 0.35),
        )

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a floor: how many rooms, on which side the common room is, how people left the furniture."""
        plan = Plan()
        count = int(rng.integers(7, 14))
        length = count * self.module - WALL
        common = int(rng.integers(2))
        for side, row in enumerate(corridor(plan, length, self.corridor)):
            modules = [1] * (count - self.kitchen) + [self.kitchen] if side == common else [1] * count
            rooms = rooms_along(row, [taken * self.module for taken in modules], WALL)
            for k, (part, width) in enumerate(rooms):
                if side == common and k == len(rooms) - 1:
                    self._common_room(part, width, rng)
                else:
                    self._room(part, width, rng)
        return plan.building("dormitory")

    def _room(self, plan: Plan, width: float, rng: np.random.Generator) -> None:
        """Draw a room: the door at the left, the shaft at the right, a window at the end."""
        across, deep = self.shaft
        left = width - across
        plan.room([(0.0, 0.0), (left, 0.0), (left, deep), (width, deep), (width, self.depth), (0.0, self.depth)])
        door(plan, 0.25, DOOR, WALL)
        plan.recess((0.8 * width, self.depth), (0.2 * width, self.depth), 0.12)
        long, wide = self.bed
        self._thing(plan, "bed", (0.08 + 0.5 * wide, self.depth - 0.1 - 0.5 * long, wide, long), 0.1, rng)
        long, wide = self.desk
        self._thing(plan, "desk", (width - 0.06 - 0.5 * wide, self.depth - 0.3 - 0.5 * long, wide, long), 0.3, rng)
        self._thing(plan, "chair", (width - wide - 0.5, self.depth - 0.3 - 0.5 * long, 0.45, 0.45), 0.3, rng)
        self._thing(plan, "shelf", (width - 0.22, deep + 0.6, 0.32, 0.8), 0.15, rng)

    def _thing(
        self, plan: Plan, kind: str, place: tuple[float, float, float, float], way: float, rng: np.random.Generator
    ) -> None:
        """Put a thing at its place, or up to `way` metres from it along the room; not every room has it."""
        x, y, long, deep = place
        if self.tidy:
            plan.thing(kind, oblong(x, y, long, deep))
        elif rng.random() < 0.85:
            plan.thing(kind, oblong(x, y - rng.uniform(0.0, way), long, deep, rng.normal(0.0, 0.02)))

    def _common_room(self, plan: Plan, width: float, rng: np.random.Generator) -> None:
        """Draw the kitchen that all share."""
        plan.room(box(0.0, 0.0, width, self.depth))
        door(plan, rng.uniform(0.3, width - DOOR - 0.3), DOOR, WALL)
        plan.block(box(0.02, self.depth - 0.65, width - rng.uniform(0.4, 1.2), self.depth - 0.02))
        for _ in range(int(rng.integers(1, 3))):
            x, y = rng.uniform(0.9, width - 0.9), rng.uniform(1.4, self.depth - 1.8)
            plan.thing("table", oblong(x, y, 1.2, 0.8, rng.uniform(-0.1, 0.1)))
