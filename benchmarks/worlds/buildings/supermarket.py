"""Supermarkets: rows of shelves, a line of equal checkouts, islands, displays that come and go."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .plan import Building, Plan
from .shapes import box, chamfered, oblong

CHECKOUT = (2.6, 0.75)  # m


@dataclass(frozen=True, slots=True)
class Supermarket:
    """A shop of a chain; lengths in metres.

    Attributes
    ----------
    shelf : (float, float)
        Length of one element and depth of a double-sided row.
    aisle : float
        Between rows.
    checkout : float
        From one checkout to the next.
    displays : float
        Share of the places for displays and pallets that are taken.
    """

    shelf: tuple[float, float]
    aisle: float
    checkout: float
    displays: float

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Supermarket:
        """Draw a style."""
        return cls((float(rng.choice([1.0, 1.25, 1.33])), rng.uniform(0.9, 1.2)), rng.uniform(1.8, 2.6),
                   rng.uniform(1.9, 2.4), float(rng.choice([0.1, 0.5])))  # fmt: skip

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a shop: how many rows of how many elements, where displays stand."""
        plan = Plan()
        rows = int(rng.integers(7, 13))
        step = self.shelf[1] + self.aisle
        length = rows * step + 2.0 * self.aisle + rng.uniform(5.0, 9.0)
        deep = [int(n) * self.shelf[0] for n in rng.integers(6, 10, 2)]
        front = 9.5
        width = front + sum(deep) + 3.0 * self.aisle + 1.5
        plan.room(box(0.0, 0.0, length, width))
        for k in range(rows):
            x = self.aisle + 0.7 + k * step
            y = front
            for part in deep:
                self._shelves(plan, x, y, part - self.shelf[0] * int(rng.random() < 0.3), rng)
                y += part + self.aisle
        self._fresh(plan, self.aisle + 0.7 + rows * step, length, width, rng)
        self._front(plan, length, rng)
        self._back(plan, length, width, rng)
        return plan.building("supermarket")

    def _shelves(self, plan: Plan, x: float, y: float, deep: float, rng: np.random.Generator) -> None:
        """Draw a row of shelves, its end displays, and what stands before them."""
        plan.block(box(x, y, x + self.shelf[1], y + deep))
        for end in (y - 0.6, y + deep + 0.1):
            if rng.random() < self.displays:
                plan.thing("display", box(x + 0.1, end, x + self.shelf[1] - 0.1, end + 0.5))
        if rng.random() < 0.6 * self.displays:
            side = rng.choice([x - 0.35, x + self.shelf[1] + 0.35])
            plan.thing("box pallet", oblong(side, rng.uniform(y + 0.5, y + deep - 0.5), 0.6, 0.8))

    def _fresh(self, plan: Plan, x: float, length: float, width: float, rng: np.random.Generator) -> None:
        """Draw tables of fruit and freezers in the open part at the right."""
        middle = 0.5 * (x + length)
        for y in np.arange(11.0, width - 4.0, rng.uniform(3.2, 4.2)):
            if rng.random() < 0.7:
                plan.thing("fruit", chamfered(middle + rng.uniform(-0.3, 0.3), y, 2.0, 1.2, 0.0, 0.2))
            else:
                plan.block(oblong(middle, y, 2.4, 1.9))

    def _front(self, plan: Plan, length: float, rng: np.random.Generator) -> None:
        """Draw checkouts, columns and the entrance in the lower wall, which runs to the right."""
        count = int(rng.integers(4, 9))
        first = rng.uniform(1.5, max(1.6, length - count * self.checkout - 6.0))
        for k in range(count):
            x = first + k * self.checkout
            plan.block(box(x, 5.0, x + CHECKOUT[1], 5.0 + CHECKOUT[0]))
            if rng.random() < 0.5:
                plan.thing("baskets", oblong(x + 0.4, 8.1, 0.5, 0.45))
        start = first + count * self.checkout + 0.5
        if start + 3.0 < length:
            plan.room(box(start, -3.3, start + 3.0, -0.3))
            plan.opening((start + 0.4, 0.0), (start + 2.6, 0.0), 0.3)
        for x in np.arange(4.0, length - 2.0, rng.uniform(5.5, 7.5)):
            plan.block(oblong(x, 3.0, 0.4, 0.4))
            if not start - 2.5 < x < start + 3.5:
                plan.recess((x + 0.8, 0.0), (x + 1.9, 0.0), 0.2)
        for x in rng.uniform(1.0, length - 1.0, int(rng.integers(1, 4))):
            plan.thing("trolleys", oblong(x, 1.0, 2.2, 0.6))

    def _back(self, plan: Plan, length: float, width: float, rng: np.random.Generator) -> None:
        """Draw the counter along the upper wall, and the store behind it."""
        a, b = sorted(rng.uniform(2.0, length - 2.0, 2))
        if b - a > 3.0:
            plan.block(box(a, width - 1.1, b, width - 0.02))
        x = rng.uniform(1.0, a - 0.5) if a > 4.0 else b + 0.4
        if x + 2.0 < length:
            plan.room(box(max(0.0, x - 2.0), width + 0.3, min(length, x + 8.0), width + 6.0))
            plan.opening((x + 1.6, width), (x + 0.2, width), 0.3, door=True)
