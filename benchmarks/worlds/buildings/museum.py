"""Museums: galleries one behind the other, their doorways in one line."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .plan import Building, Plan
from .shapes import box, oblong

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Museum:
    """Enfilades of galleries side by side; lengths in metres.

    Attributes
    ----------
    gallery : (float, float)
        Least and greatest side of a gallery.
    doorway : float
        Width.
    wall : float
        Thickness.
    crowded : bool
        True if anything stands in the galleries.
    """

    gallery: tuple[float, float]
    doorway: float
    wall: float
    crowded: bool

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Museum:
        """Draw a style."""
        low = rng.uniform(6.0, 8.0)
        gallery = (low, low + float(rng.choice([0.0, rng.uniform(1.0, 7.0)])))
        return cls(gallery, rng.uniform(1.4, 2.4), rng.uniform(0.35, 0.7), bool(rng.random() < 0.6))

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a floor: how many galleries of what size, which doorways there are, what is shown."""
        plan = Plan()
        xs = self._starts(int(rng.integers(3, 6)), rng)
        ys = self._starts(int(rng.integers(2, 4)), rng)
        columns, rows = len(xs) - 1, len(ys) - 1
        # One axis for the doorways of each row and of each column of galleries.
        across = [rng.uniform(0.3, 0.7) * (ys[j + 1] - ys[j] - self.wall) + ys[j] for j in range(rows)]
        along = [rng.uniform(0.3, 0.7) * (xs[k + 1] - xs[k] - self.wall) + xs[k] for k in range(columns)]
        half = 0.5 * self.doorway
        for k in range(columns):
            for j in range(rows):
                room = (xs[k], ys[j], xs[k + 1] - self.wall, ys[j + 1] - self.wall)
                plan.room(box(*room))
                if self.crowded:
                    self._shown(plan.at(room[0], room[1]), room[2] - room[0], room[3] - room[1], rng)
        for j in range(rows):
            closed = int(rng.integers(columns - 1)) if j and rng.random() < 0.4 else -1
            for k in range(columns - 1):
                if k != closed:
                    x = xs[k + 1] - self.wall
                    plan.opening((x, across[j] - half), (x, across[j] + half), self.wall)
        for j in range(rows - 1):
            through = rng.random(columns) < 0.4
            through[[0, -1]] = True
            y = ys[j + 1] - self.wall
            for middle in np.array(along)[through]:
                plan.opening((middle + half, y), (middle - half, y), self.wall)
        return plan.building("museum")

    def _starts(self, count: int, rng: np.random.Generator) -> Floats:
        """Return where galleries begin along one axis, and where the last one's wall ends."""
        sides = rng.uniform(*self.gallery, count)
        return np.concatenate([[0.0], np.cumsum(sides + self.wall)])

    def _shown(self, plan: Plan, width: float, depth: float, rng: np.random.Generator) -> None:
        """Put plinths, showcases or a bench into a gallery."""
        what = rng.choice(["plinths", "showcases", "bench", "partition"], p=[0.35, 0.25, 0.25, 0.15])
        if what == "plinths":
            for _ in range(int(rng.integers(2, 6))):
                side = rng.uniform(0.4, 0.9)
                x, y = rng.uniform(0.2, 0.8) * width, rng.uniform(0.2, 0.8) * depth
                plan.thing("plinth", oblong(x, y, side, side, rng.uniform(0.0, 1.5)))
        elif what == "showcases":
            for x in (0.3 * width, 0.7 * width):
                plan.thing("showcase", oblong(x, 0.5 * depth, 0.7, rng.uniform(0.25, 0.5) * depth))
        elif what == "partition":
            plan.block(oblong(0.5 * width, rng.uniform(0.3, 0.7) * depth, 0.45 * width, 0.25))
        if what != "partition":
            x, y = rng.uniform(0.35, 0.65) * width, rng.uniform(0.4, 0.6) * depth
            plan.thing("bench", oblong(x, y, 1.8, 0.5, float(rng.choice([0.0, 1.5708]))))
