"""Terraces: one house again and again in a row, each with a front room, a kitchen behind it, and a yard."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .plan import Building, Plan
from .shapes import box, oblong

PARTY = 0.25  # m; wall between houses
INNER = 0.12  # m; wall between rooms
OUTER = 0.3  # m
DOOR = 0.85  # m


@dataclass(frozen=True, slots=True)
class Terraces:
    """The ground floors of a row of houses; lengths in metres.

    Attributes
    ----------
    width : float
        Of a house.
    front, back, yard : float
        Depths of the front room, of the kitchen and of the yard behind it.
    hall : float
        Width of the hall, which leads past the front room to the kitchen.
    chimney : (float, float)
        Of the chimney breast in the front room, along the party wall and into the room.
    """

    width: float
    front: float
    back: float
    yard: float
    hall: float
    chimney: tuple[float, float]

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Terraces:
        """Draw a style."""
        chimney = (rng.uniform(1.2, 1.6), rng.uniform(0.3, 0.45))
        return cls(
            rng.uniform(4.6, 6.0), rng.uniform(3.8, 5.0), rng.uniform(3.0, 4.2), rng.uniform(3.0, 6.0),
            rng.uniform(1.0, 1.4), chimney,
        )  # fmt: skip

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a row: how many houses, what people have in them and in their yards."""
        plan = Plan()
        for k in range(int(rng.integers(5, 10))):
            self._house(plan.at(k * (self.width + PARTY), 0.0), rng)
        return plan.building("terraces")

    def _house(self, plan: Plan, rng: np.random.Generator) -> None:
        """Draw a house whose front door is at the left: hall and front room, then the kitchen, then the yard."""
        width, parlour = self.width, self.hall + INNER
        kitchen, end = self.front + INNER, self.front + INNER + self.back
        plan.room(box(0.0, 0.0, self.hall, self.front))
        middle, (broad, deep) = 0.5 * self.front, self.chimney
        breast = [(width, middle - 0.5 * broad), (width - deep, middle - 0.5 * broad)]
        breast += [(width - deep, middle + 0.5 * broad), (width, middle + 0.5 * broad)]
        plan.room([(parlour, 0.0), (width, 0.0), *breast, (width, self.front), (parlour, self.front)])
        plan.room(box(0.0, kitchen, width, end))
        plan.room(box(0.0, end + OUTER, width, end + OUTER + self.yard))
        plan.recess((0.1, 0.0), (0.1 + DOOR, 0.0), 0.15)
        plan.recess((parlour + 0.6, 0.0), (width - 0.6, 0.0), 0.18)
        plan.opening((parlour, self.front - 0.3), (parlour, self.front - 0.3 - DOOR), INNER, door=True)
        plan.opening((0.15, kitchen), (0.15 + DOOR, kitchen), INNER, door=True)
        plan.opening((0.2, end + OUTER), (0.2 + DOOR, end + OUTER), OUTER, door=True)
        furniture = [
            ("sofa", (parlour + 0.5, 0.4 * self.front, 0.85, 1.9)), ("cabinet", (width - 0.3, 0.35, 0.45, 0.6)),
            ("table", (0.55 * width, kitchen + 0.5 * self.back, 1.3, 0.8)),
            ("dresser", (width - 0.3, kitchen + 0.6 * self.back, 0.45, 1.3)),
            ("stove", (0.6 * width, end - 0.35, 0.6, 0.6)), ("fridge", (0.6 * width + 0.8, end - 0.35, 0.6, 0.65)),
            ("shed", (width - 0.8, end + OUTER + self.yard - 0.8, 1.3, 1.2)),
        ]  # fmt: skip
        for kind, (x, y, long, across) in furniture:
            if rng.random() < 0.8:
                x, y = x + rng.uniform(-0.05, 0.05), y + rng.uniform(-0.3, 0.3)
                plan.thing(kind, oblong(x, y, long, across, rng.normal(0.0, 0.02)))
