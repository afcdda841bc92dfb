"""Streets between rows of houses: facades with bays and recessed doors, parked cars, lamps and trees."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .plan import Building, Plan
from .shapes import chamfered, ring

DEEP = 10.0  # m; of a house


@dataclass(frozen=True, slots=True)
class Facades:
    """A street; lengths in metres.

    Attributes
    ----------
    house : (float, float)
        Least and greatest width.
    street : float
        From one row of houses to the other.
    setback : float
        Variation of the fronts.
    door : (float, float)
        Width and depth of the recess of a door.
    terraced : bool
        True if all houses are alike.
    """

    house: tuple[float, float]
    street: float
    setback: float
    door: tuple[float, float]
    terraced: bool

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Facades:
        """Draw a style."""
        low = rng.uniform(5.0, 7.0)
        door = (rng.uniform(1.1, 1.6), rng.uniform(0.25, 0.6))
        if rng.random() < 0.4:
            return cls((low, low), rng.uniform(10.0, 17.0), 0.0, door, terraced=True)
        house = (low, low + rng.uniform(0.5, 8.0))
        return cls(house, rng.uniform(10.0, 17.0), rng.uniform(0.0, 0.8), door, terraced=False)

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a street with a side street: how many houses, how wide, what is parked."""
        plan = Plan()
        length = rng.uniform(60.0, 110.0)
        side = rng.uniform(0.3, 0.6) * length
        gap = (side, side + rng.uniform(7.0, 11.0))
        rows = plan.at(0.0, self.street), plan.at(length, 0.0, math.pi)
        self._row(rows[0], length, gap, rng)
        # Half of the side streets go on across the street, the others end here.
        self._row(rows[1], length, (length - gap[1], length - gap[0]) if rng.random() < 0.5 else None, rng)
        for kerb in (plan.at(0.0, 0.0), plan.at(length, self.street, math.pi)):
            self._parked(kerb, length, rng)
        return plan.building("facades")

    def _row(self, plan: Plan, length: float, gap: tuple[float, float] | None, rng: np.random.Generator) -> None:
        """Draw houses along x, their fronts at about y = 0 and the street below, none in the gap."""
        x = 0.0
        while x < length:
            width = rng.uniform(*self.house)
            if gap is not None and x < gap[1] and x + width > gap[0]:
                x = gap[1]
                continue
            # Houses that were built one by one do not stand quite in line.
            turn = 0.0 if self.terraced else rng.normal(0.0, 0.02)
            self._house(plan.at(x, rng.uniform(0.0, self.setback), turn), width, rng)
            # Most houses stand wall to wall; some leave an alley.
            x += width + (rng.uniform(1.2, 3.0) if rng.random() < 0.15 else 0.0)

    def _house(self, plan: Plan, width: float, rng: np.random.Generator) -> None:
        """Draw a house: a front with a door, and a bay where there is room."""
        corners = [(width, 0.0), (width, DEEP), (0.0, DEEP), (0.0, 0.0)]
        recess, deep = self.door
        at = 0.6 if self.terraced else rng.uniform(0.4, 0.35 * width)
        front = [(at, 0.0), (at, deep), (at + recess, deep), (at + recess, 0.0)]
        bay = at + recess + 0.6
        if width - bay > 2.2 and (self.terraced or rng.random() < 0.5):
            front += [(bay, 0.0), (bay + 0.4, -0.6), (bay + 1.6, -0.6), (bay + 2.0, 0.0)]
        plan.block(np.array([*front, *corners]))

    def _parked(self, plan: Plan, length: float, rng: np.random.Generator) -> None:
        """Draw cars along a kerb, and lamps and trees between them and the houses at y = 0."""
        x = rng.uniform(0.0, 5.0)
        while x < length - 6.0:
            if rng.random() < 0.6:
                long = rng.uniform(3.8, 4.9)
                turn = rng.normal(0.0, 0.02)
                plan.thing("car", chamfered(x + 0.5 * long, rng.normal(2.8, 0.08), long, 1.8, turn, 0.25))
            x += rng.uniform(5.2, 6.5)
        for x in np.arange(rng.uniform(2.0, 8.0), length, rng.uniform(11.0, 17.0)):
            plan.block(ring(x, 1.5, float(rng.choice([0.1, 0.22])), 6))
