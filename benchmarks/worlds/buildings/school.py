"""Schools: classrooms full of tables along a wide corridor, and a gymnasium."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .corridors import corridor, door, rooms_along
from .plan import Building, Plan
from .shapes import box, oblong

WALL = 0.24  # m
DOOR = 1.0  # m
TABLE = (1.3, 0.5)  # m


@dataclass(frozen=True, slots=True)
class School:
    """A floor of a school; lengths in metres.

    Attributes
    ----------
    classroom : (float, float)
        Along the corridor and away from it.
    corridor : float
        Its width.
    lockers : float
        Depth of the rows of lockers along the corridor's walls, 0 for none.
    one_sided : bool
        True if rooms lie on one side alone, and windows on the other.
    tidy : bool
        True if tables stand in line.
    """

    classroom: tuple[float, float]
    corridor: float
    lockers: float
    one_sided: bool
    tidy: bool

    @classmethod
    def draw(cls, rng: np.random.Generator) -> School:
        """Draw a style."""
        room = (rng.uniform(8.2, 10.0), rng.uniform(6.8, 8.2))
        one_sided, tidy = rng.random(2) < [0.4, 0.5]
        return cls(room, rng.uniform(2.8, 4.2), float(rng.choice([0.0, 0.4])), bool(one_sided), bool(tidy))

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a floor: how many rooms, in what order, how the tables stand."""
        plan = Plan()
        count = int(rng.integers(4, 8)) + (2 if self.one_sided else 0)
        length = count * self.classroom[0] - WALL
        above, below = corridor(plan, length, self.corridor)
        self._row(above, count, rng)
        if self.one_sided:
            self._windows(plan, length)
        else:
            self._row(below, count, rng)
        if rng.random() < 0.6:
            self._gymnasium(plan, length, rng)
        return plan.building("school")

    def _row(self, plan: Plan, count: int, rng: np.random.Generator) -> None:
        """Draw classrooms, and where there are two small rooms in the place of one, a staff room and a store."""
        module = self.classroom[0]
        half = [rng.random() < 0.2 for _ in range(count)]
        widths = [w for small in half for w in ([0.5 * module] * 2 if small else [module])]
        for part, width in rooms_along(plan, widths, WALL):
            if width < 0.7 * module:
                self._small(part, width, rng)
            else:
                self._class(part, width, rng)

    def _class(self, plan: Plan, width: float, rng: np.random.Generator) -> None:
        """Draw a classroom with its board at the left, tables in rows."""
        depth = self.classroom[1]
        plan.room(box(0.0, 0.0, width, depth))
        door(plan, 0.4, DOOR, WALL)
        if self.lockers > 0.0:
            # In the corridor, next to the door.
            plan.thing("lockers", box(0.45 * width, -WALL - self.lockers, 0.9 * width, -WALL - 0.02))
        loose = 0.0 if self.tidy else 1.0
        plan.thing("teacher's desk", oblong(1.6, 0.65 * depth, 0.7, 1.5, loose * rng.normal(0.0, 0.05)))
        plan.thing("cupboard", box(width - 0.5, 0.4, width - 0.02, 1.8 + loose * rng.uniform(-0.4, 0.6)))
        for x in np.arange(3.2, width - 1.3, 1.7 + loose * rng.uniform(-0.2, 0.2)):
            for y in np.linspace(1.3, depth - 1.0, 3):
                if self.tidy or rng.random() < 0.85:
                    shift, turn = loose * rng.normal(0.0, 0.08, 2), loose * rng.normal(0.0, 0.04)
                    plan.thing("table", oblong(x + shift[0], y + shift[1], *TABLE, 0.5 * math.pi + turn))

    def _small(self, plan: Plan, width: float, rng: np.random.Generator) -> None:
        plan.room(box(0.0, 0.0, width, self.classroom[1]))
        door(plan, rng.uniform(0.2, 0.3 * width), DOOR, WALL)
        plan.thing("shelf", box(width - 0.4, 1.0, width - 0.02, self.classroom[1] - 1.0))
        plan.thing("table", oblong(0.45 * width, 0.6 * self.classroom[1], 1.8, 0.9, rng.uniform(0.0, 1.5)))

    def _windows(self, plan: Plan, length: float) -> None:
        """Set back the windows in the corridor's lower wall, between piers."""
        step = 0.5 * self.classroom[0]
        for x in np.arange(0.4, length - step, step):
            plan.recess((x, 0.0), (x + step - 0.6, 0.0), 0.25)

    def _gymnasium(self, plan: Plan, length: float, rng: np.random.Generator) -> None:
        """Draw a hall behind the right end of the corridor, wall bars in niches along its side."""
        wide, long = rng.uniform(13.0, 16.0), rng.uniform(20.0, 27.0)
        x, y = length + 0.3, 0.5 * self.corridor - rng.uniform(0.3, 0.7) * long
        plan.room(box(x, y, x + wide, y + long))
        middle = 0.5 * self.corridor
        plan.opening((length, middle - 0.9), (length, middle + 0.9), 0.3, door=True)
        for k in np.arange(2.0, long - 4.0, 4.5):
            plan.recess((x + wide, y + k), (x + wide, y + k + 2.5), 0.4)
        for _ in range(int(rng.integers(1, 4))):
            plan.thing("mats", oblong(x + rng.uniform(2.0, wide - 2.0), y + rng.uniform(3.0, long - 3.0), 2.0, 1.0))
