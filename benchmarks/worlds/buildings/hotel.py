"""Hotels: long corridors of rooms that are all the same, every other one a mirror image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .corridors import corridor, door, rooms_along
from .plan import Building, Plan
from .shapes import box, oblong

WALL = 0.2  # m
INNER = 0.1  # m
DOOR = 0.9  # m


@dataclass(frozen=True, slots=True)
class Hotel:
    """A floor of a hotel; lengths in metres.

    Attributes
    ----------
    module, depth : float
        Of a room, along the corridor and away from it.
    corridor : float
        Its width.
    bathroom : (float, float)
        Between corridor and room.
    bed : float
        Its width.
    tidy : bool
        True if the furniture stands alike in all rooms.
    """

    module: float
    depth: float
    corridor: float
    bathroom: tuple[float, float]
    bed: float
    tidy: bool

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Hotel:
        """Draw a style."""
        bathroom = (rng.uniform(1.6, 2.0), rng.uniform(2.0, 2.6))
        bed, tidy = float(rng.choice([1.0, 1.4, 1.8])), bool(rng.random() < 0.5)
        return cls(rng.uniform(3.4, 4.2), rng.uniform(6.2, 7.8), rng.uniform(1.5, 2.0), bathroom, bed, tidy)

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a floor: how many rooms, where the lifts and stairs are, how guests left the furniture."""
        plan = Plan()
        count = int(rng.integers(8, 15))
        length = count * self.module - WALL
        above, below = corridor(plan, length, self.corridor)
        lifts = int(rng.integers(1, count - 2))
        for row, served in ((above, True), (below, False)):
            # On one side the lifts and the linen room take the place of two rooms.
            for k, (part, width) in enumerate(rooms_along(row, [self.module] * count, WALL, _pairs(count, rng))):
                if served and k in (lifts, lifts + 1):
                    self._service(part, width, lift=k == lifts)
                else:
                    self._room(part, width, rng)
        for x in (0.0, length):
            self._stairs(plan, x, length)
        return plan.building("hotel")

    def _room(self, plan: Plan, width: float, rng: np.random.Generator) -> None:
        """Draw a room: the door at the left, bathroom at the right, bed along the right wall."""
        across, deep = self.bathroom
        left = width - across
        room = [(0.0, 0.0), (left - INNER, 0.0), (left - INNER, deep + INNER), (width, deep + INNER),
                (width, self.depth), (0.0, self.depth)]  # fmt: skip
        plan.room(room)
        door(plan, 0.2, DOOR, WALL)
        plan.room(box(left, 0.0, width, deep))
        plan.opening((left, deep - 0.4), (left, deep - 1.15), INNER, door=True)
        plan.block(box(width - 0.75, 0.0, width - 0.02, 1.5))
        plan.recess((0.7 * width, self.depth), (0.3 * width, self.depth), 0.15)
        middle = deep + 0.55 * (self.depth - deep)
        plan.thing("bed", oblong(width - 1.02, middle, 2.0, self.bed))
        loose = 0.0 if self.tidy else 1.0
        plan.thing("desk", oblong(0.32, middle + loose * rng.uniform(-0.1, 0.1), 0.5, 1.4))
        y, turn = middle + loose * rng.uniform(-0.8, 0.8), loose * rng.uniform(0.0, 1.5)
        plan.thing("chair", oblong(0.85, y, 0.5, 0.5, turn))
        if self.tidy or rng.random() < 0.7:
            x, turn = 0.9 + loose * rng.uniform(-0.3, 0.3), 0.8 + loose * rng.uniform(-0.8, 0.8)
            plan.thing("armchair", oblong(x, self.depth - 0.6, 0.75, 0.7, turn))

    def _service(self, plan: Plan, width: float, *, lift: bool) -> None:
        """Draw two lift doors in a lobby, or a linen room."""
        deep = 2.2 if lift else self.depth
        plan.room(box(0.0, 0.0, width, deep))
        door(plan, 0.2, width - 0.4 if lift else DOOR, WALL, leaf=not lift)
        if lift:
            for x in (0.15 * width, 0.55 * width):
                plan.recess((x + 1.1, deep), (x, deep), 0.12)
        else:
            plan.block(box(0.02, 2.0, 0.6, deep - 0.5))

    def _stairs(self, plan: Plan, x: float, length: float) -> None:
        """Draw a stairwell behind an end of the corridor."""
        high = self.corridor + 1.5
        if x == 0.0:
            plan.room(box(-5.0, -1.5, -WALL, high))
            plan.opening((0.0, 0.5 * self.corridor + 0.5), (0.0, 0.5 * self.corridor - 0.5), WALL, door=True)
            plan.block(box(-4.0, -0.2, -2.0, high - 1.3))
        else:
            plan.room(box(length + WALL, -1.5, length + 5.0, high))
            plan.opening((length, 0.5 * self.corridor - 0.5), (length, 0.5 * self.corridor + 0.5), WALL, door=True)
            plan.block(box(length + 2.0, -0.2, length + 4.0, high - 1.3))


def _pairs(count: int, rng: np.random.Generator) -> list[bool]:
    """Return which rooms are mirrored: every other one, bathrooms and beds back to back."""
    first = int(rng.integers(2))
    return [bool((k + first) % 2) for k in range(count)]
