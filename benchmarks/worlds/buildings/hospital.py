"""Hospitals: wards of equal rooms with two beds and a bathroom, on both sides of a wide corridor."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .corridors import corridor, door, modules, rooms_along
from .plan import Building, Plan
from .shapes import box, oblong

WALL = 0.18  # m
DOOR = 1.25  # m; a bed passes
BED = (2.05, 0.95)  # m


@dataclass(frozen=True, slots=True)
class Hospital:
    """A ward floor of two wings at a right angle; lengths in metres.

    Attributes
    ----------
    module, depth : float
        Of a patients' room, along the corridor and away from it.
    corridor : float
        Its width.
    bathroom : (float, float)
        Inside each room, next to its door.
    tidy : bool
        True if every bed stands in its place.
    """

    module: float
    depth: float
    corridor: float
    bathroom: tuple[float, float]
    tidy: bool

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Hospital:
        """Draw a style."""
        bathroom = (rng.uniform(1.7, 2.0), rng.uniform(1.8, 2.2))
        return cls(
            rng.uniform(4.0, 4.6), rng.uniform(5.6, 6.8), rng.uniform(2.4, 3.2), bathroom, bool(rng.random() < 0.5)
        )

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a floor: how many rooms, which of them serve staff, where beds are."""
        plan = Plan()
        length = self._wing(plan, int(rng.integers(6, 11)), rng)
        # The second wing leaves from a lobby at the right end of the first, upwards.
        left = length + 0.3
        lobby = (left, -2.0, left + self.depth + self.corridor + 3.3, self.corridor + 2.0)
        plan.room(box(*lobby))
        plan.opening((length, 0.5), (length, self.corridor - 0.5), 0.3)
        second = plan.at(lobby[2] - 2.0, lobby[3] + 0.3, 0.5 * math.pi)
        self._wing(second, int(rng.integers(3, 7)), rng)
        second.opening((0.0, self.corridor - 0.5), (0.0, 0.5), 0.3)
        plan.block(oblong(lobby[0] + 3.0, 0.5 * self.corridor + rng.uniform(-1.0, 1.0), 2.8, 1.0))
        for _ in range(int(rng.integers(2, 5))):
            x, y = rng.uniform(lobby[0] + 1.0, lobby[2] - 1.0), rng.choice([lobby[1] + 0.4, lobby[3] - 0.4])
            plan.thing("chairs", oblong(x, y, 1.8, 0.5))
        return plan.building("hospital")

    def _wing(self, plan: Plan, count: int, rng: np.random.Generator) -> float:
        """Draw a wing along x from the origin; return its length."""
        length = count * self.module - WALL
        above, below = corridor(plan, length, self.corridor)
        for row in (above, below):
            widths = modules(rng, count, self.module, 0.08)
            sides = [bool(k % 2) for k in range(len(widths))]
            for part, width in rooms_along(row, widths, WALL, sides):
                if width > self.module or rng.random() < 0.15:
                    self._staff(part, width, rng)
                else:
                    self._patients(part, width, rng)
        for _ in range(int(rng.integers(1, 4))):
            y = rng.choice([0.35, self.corridor - 0.35])
            plan.thing("trolley", oblong(rng.uniform(1.0, length - 1.0), y, 0.9, 0.5))
        return length

    def _patients(self, plan: Plan, width: float, rng: np.random.Generator) -> None:
        """Draw a room: door at the left, bathroom at the right, two beds along the right wall."""
        across, deep = self.bathroom
        left = width - across
        room = [(0.0, 0.0), (left - 0.1, 0.0), (left - 0.1, deep + 0.1), (width, deep + 0.1), (width, self.depth),
                (0.0, self.depth)]  # fmt: skip
        plan.room(room)
        door(plan, 0.25, DOOR, WALL)
        plan.room(box(left, 0.0, width, deep))
        plan.opening((left, deep - 0.3), (left, deep - 1.2), 0.1, door=True)
        plan.block(box(left + 0.3, 0.0, left + 0.75, 0.6))
        plan.thing("locker", oblong(width - 0.3, 0.5 * (deep + self.depth), 0.45, 0.4))
        for y in (deep + 0.85, self.depth - 0.75):
            if self.tidy:
                plan.thing("bed", oblong(width - 0.1 - 0.5 * BED[0], y, *BED))
            elif rng.random() < 0.85:
                x = width - rng.uniform(0.08, 0.25) - 0.5 * BED[0]
                plan.thing("bed", oblong(x, y + rng.uniform(-0.05, 0.05), *BED, rng.normal(0.0, 0.02)))

    def _staff(self, plan: Plan, width: float, rng: np.random.Generator) -> None:
        """Draw a nurses' room or a store."""
        plan.room(box(0.0, 0.0, width, self.depth))
        door(plan, rng.uniform(0.3, width - DOOR - 0.3), DOOR, WALL)
        plan.thing("desk", oblong(rng.uniform(1.2, width - 1.2), 0.6 * self.depth, 1.6, 0.8))
        plan.thing("cabinet", box(0.3, self.depth - 0.5, width - rng.uniform(0.3, 1.5), self.depth - 0.05))
