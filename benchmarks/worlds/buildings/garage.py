"""Parking garages: columns in a grid, cars in some of the slots, stairs and a ramp."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .plan import Building, Plan
from .shapes import box, chamfered, oblong

STAIRS = (5.0, 4.2)  # m; along the slots and across
RAMP_WALL = 0.25  # m


@dataclass(frozen=True, slots=True)
class Garage:
    """A level of a garage; lengths in metres.

    Attributes
    ----------
    slot : (float, float)
        Width and depth of a parking slot.
    lane : float
        Between two rows of slots.
    column : float
        Side of a column; one stands between every `per_column` slots.
    per_column : int
    full : float
        Share of the slots that are taken.
    """

    slot: tuple[float, float]
    lane: float
    column: float
    per_column: int
    full: float

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Garage:
        """Draw a style."""
        slot = (rng.uniform(2.4, 2.7), rng.uniform(4.8, 5.2))
        return cls(
            slot, rng.uniform(5.6, 6.5), rng.uniform(0.3, 0.45), int(rng.integers(2, 4)), rng.uniform(0.03, 0.75)
        )

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a level: how many lanes and slots, which are taken, where stairs and ramp are."""
        plan = Plan()
        lanes = int(rng.integers(2, 4))
        fields = int(rng.integers(6, 10)) + (2 if lanes == 2 else 0)
        slots = fields * self.per_column
        module = 2.0 * self.slot[1] + self.lane
        length = slots * self.slot[0] + 2.0 * self.lane
        plan.room(box(0.0, 0.0, length, lanes * module))
        self._way_out(plan, lanes * module, rng)
        rows = 2 * lanes
        stairs = {int(row): int(rng.integers(0, slots - 2)) for row in rng.choice(rows, 2, replace=False)}
        ramp = int(rng.integers(0, max(1, lanes - 1)))
        for row in range(rows):
            # Lower rows of a module open upwards, upper ones downwards.
            base = (row // 2) * module
            lower, upper = plan.at(self.lane, base), plan.at(length - self.lane, base + module, math.pi)
            self._row(upper if row % 2 else lower, slots, stairs.get(row), rng)
        if lanes > 1:
            self._ramp(plan, length, (ramp + 1) * module, rng)
        return plan.building("garage")

    def _row(self, plan: Plan, slots: int, stairs: int | None, rng: np.random.Generator) -> None:
        """Draw one row of slots along x, their backs at y = 0."""
        width, depth = self.slot
        for k in range(0, slots + 1, self.per_column):
            if stairs is None or not stairs <= k <= stairs + 2:
                plan.block(oblong(k * width, depth - 0.9, self.column, self.column))
        if stairs is not None:
            x = stairs * width + 0.3
            plan.block(box(x, 0.3, x + STAIRS[0], 0.3 + STAIRS[1]))
        for k in range(slots):
            if stairs is not None and stairs <= k <= stairs + 2:
                continue
            if rng.random() < self.full:
                length, broad = rng.uniform(3.8, 4.8), rng.uniform(1.66, 1.82)
                y = 0.35 + 0.5 * length + rng.uniform(0.0, max(0.0, depth - 0.35 - length))
                x = (k + 0.5) * width + rng.normal(0.0, 0.04)
                turn = 0.5 * math.pi + rng.normal(0.0, 0.015)
                plan.thing("car", chamfered(x, y, length, broad, turn, 0.25))

    def _ramp(self, plan: Plan, length: float, y: float, rng: np.random.Generator) -> None:
        """Part two modules by a wall over some of their length, as along a ramp."""
        low = self.lane + rng.uniform(0.0, 0.5) * (length - 2.0 * self.lane)
        high = min(length - self.lane, low + rng.uniform(12.0, 25.0))
        plan.block(box(low, y - 0.5 * RAMP_WALL, high, y + 0.5 * RAMP_WALL))

    def _way_out(self, plan: Plan, width: float, rng: np.random.Generator) -> None:
        """Set the gates into both end walls, and a lift lobby behind the left one."""
        y = rng.uniform(3.0, width - 12.0)
        plan.recess((0.0, y + 5.5), (0.0, y), 1.2)
        plan.room(box(-4.2, y + 6.5, -0.2, y + 10.5))
        plan.opening((0.0, y + 8.9), (0.0, y + 7.9), 0.2, door=True)
