"""Open-plan offices parted into cubicles."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .plan import Building, Plan
from .shapes import box, oblong

THIN = 0.06  # m; of a partition
DESK = 0.75  # m


@dataclass(frozen=True, slots=True)
class Cubicles:
    """A floor of cubicles; lengths in metres.

    Attributes
    ----------
    cell : (float, float)
        Of a cubicle, along a cluster and across half of it.
    entrance : float
        Gap in a cubicle's front.
    aisle : float
        Between clusters.
    bay : float
        Between columns.
    tidy : bool
        True if every cell has its desk, and chairs are pushed under it.
    """

    cell: tuple[float, float]
    entrance: float
    aisle: float
    bay: float
    tidy: bool

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Cubicles:
        """Draw a style."""
        cell = (rng.uniform(2.0, 2.6), rng.uniform(2.0, 2.6))
        return cls(cell, rng.uniform(0.9, 1.1), rng.uniform(1.3, 1.8), rng.uniform(7.0, 9.0),
                   bool(rng.random() < 0.5))  # fmt: skip

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a floor: how many clusters of how many cells, what is left out, meeting rooms along one side."""
        plan = Plan()
        columns, rows = int(rng.integers(2, 4)), int(rng.integers(3, 5))
        cells = [int(n) for n in rng.integers(3, 5, columns)]
        deep = 2.0 * self.cell[1]
        length = sum(cells) * self.cell[0] + (columns + 1) * (self.aisle + 0.4)
        width = rows * deep + (rows + 1) * self.aisle
        plan.room(box(0.0, 0.0, length, width))
        x = self.aisle + 0.4
        for count in cells:
            for row in range(rows):
                if rng.random() < 0.12:
                    self._lounge(plan.at(x, self.aisle + row * (deep + self.aisle)), rng)
                    continue
                part = plan.at(x, self.aisle + row * (deep + self.aisle))
                self._cluster(part, count, rng)
            x += count * self.cell[0] + self.aisle + 0.4
        self._meeting_rooms(plan, length, width, rng)
        for x in np.arange(0.8 * self.bay, length - 1.0, self.bay):
            for y in (0.25, width - 0.25):
                plan.block(oblong(x, y, 0.45, 0.45))
        return plan.building("cubicles")

    def _cluster(self, plan: Plan, count: int, rng: np.random.Generator) -> None:
        """Draw two rows of cells back to back."""
        across, deep = self.cell
        middle = deep - 0.5 * THIN
        # The partition between the rows, then the cells on both of its sides.
        plan.block(box(0.0, middle, count * across, middle + THIN))
        for part in (plan.at(0.0, middle + THIN), plan.at(count * across, middle, math.pi)):
            for k in range(count + 1):
                x = min(k * across, count * across - THIN)
                part.block(box(x, 0.0, x + THIN, deep - THIN))
            for k in range(count):
                right = (k + 1) * across
                part.block(box(k * across + self.entrance, deep - THIN, min(right + THIN, count * across), deep))
                if self.tidy or rng.random() < 0.9:
                    part.thing("desk", box(k * across + THIN + 0.05, 0.03, right - 0.1, DESK))
                if not self.tidy and rng.random() < 0.6:
                    part.thing("chair", oblong(k * across + rng.uniform(0.7, 1.4), DESK + 0.45, 0.5, 0.5,
                                               rng.uniform(0.0, 1.5)))  # fmt: skip

    def _lounge(self, plan: Plan, rng: np.random.Generator) -> None:
        """Draw a table and a copier where a cluster is left out."""
        plan.thing("table", oblong(2.5, self.cell[1], rng.uniform(1.5, 3.0), 1.0, rng.uniform(0.0, 1.5)))
        plan.thing("copier", oblong(5.0, rng.uniform(0.5, 1.5), 0.9, 0.7))

    def _meeting_rooms(self, plan: Plan, length: float, width: float, rng: np.random.Generator) -> None:
        """Draw rooms behind the upper wall, which runs to the left."""
        x = 0.0
        while x + 3.0 < length:
            room = min(rng.uniform(3.0, 6.0), length - x)
            plan.room(box(x, width + 0.12, x + room - 0.12, width + 4.2))
            if room > 2.0:
                start = x + rng.uniform(0.3, room - 1.5)
                plan.opening((start + 0.95, width), (start, width), 0.12, door=True)
                plan.thing("table", oblong(x + 0.5 * room, width + 2.4, 0.5 * room, 1.0))
            x += room
