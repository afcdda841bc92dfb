"""Factories: a hall of columns, machines of many shapes in no order that repeats, conveyors and pallets."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .plan import Building, Plan
from .shapes import box, chamfered, oblong

FENCE = 0.05  # m
STATIONS = ("press", "lathes", "robot", "conveyor", "store", "tank", "nothing")
ODDS = (0.2, 0.22, 0.16, 0.12, 0.14, 0.08, 0.08)


@dataclass(frozen=True, slots=True)
class Factory:
    """A hall; lengths in metres.

    Attributes
    ----------
    station : (float, float)
        The area of one machine or group of them.
    way : float
        Between stations.
    column : float
        Side of the columns, one at every second corner of the stations.
    slant : float
        Angle of the lower wall, which follows the plot, to the others; radians, 0 for a rectangular hall.
    """

    station: tuple[float, float]
    way: float
    column: float
    slant: float

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Factory:
        """Draw a style."""
        slant = float(rng.choice([0.0, rng.uniform(0.01, 0.05)]))
        station = (rng.uniform(8.0, 11.0), rng.uniform(6.5, 8.5))
        return cls(station, rng.uniform(2.6, 3.6), rng.uniform(0.3, 0.6), slant)

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a hall: how many stations, what is made at each."""
        plan = Plan()
        columns, rows = int(rng.integers(4, 8)), int(rng.integers(3, 6))
        across, deep = self.station[0] + self.way, self.station[1] + self.way
        length, width = columns * across + self.way, rows * deep + self.way
        plan.room([(0.0, 0.0), (length, -length * math.tan(self.slant)), (length, width), (0.0, width)])
        for k in range(columns):
            for j in range(rows):
                x, y = self.way + k * across, self.way + j * deep
                if k % 2 and j:
                    plan.block(oblong(x - 0.5 * self.way + 0.9, y - 0.5, self.column, self.column))
                self._station(plan.at(x, y), str(rng.choice(STATIONS, p=ODDS)), rng)
        self._annexes(plan, length, width, rng)
        return plan.building("factory")

    def _station(self, plan: Plan, what: str, rng: np.random.Generator) -> None:
        """Draw what stands in one area."""
        width, depth = self.station
        if what == "press":
            _press(plan, width, depth, rng)
        elif what == "lathes":
            turn = float(rng.choice([0.0, 0.0, 0.3, 0.5]))
            for x in np.arange(1.2, width - 1.0, 2.6):
                plan.block(oblong(x, rng.uniform(0.3, 0.4) * depth, 1.1, rng.uniform(2.0, 3.0), turn))
                plan.thing("parts", oblong(x + rng.uniform(-0.3, 0.3), 0.8 * depth, 0.8, 0.6))
        elif what == "robot":
            _robot(plan, width, depth, rng)
        elif what == "conveyor":
            y = rng.uniform(0.3, 0.7) * depth
            plan.block(box(0.3, y, width - rng.uniform(0.3, 2.5), y + 0.8))
            for x in rng.uniform(0.5, width - 1.0, int(rng.integers(2, 6))):
                plan.thing("crate", oblong(x, y + rng.choice([-0.7, 1.5]), 0.6, 0.6, rng.uniform(0.0, 1.5)))
        elif what == "store":
            for x in np.arange(0.8, width - 0.5, 1.5):
                for y in np.arange(0.7, depth - 0.5, 1.4):
                    if rng.random() < 0.45:
                        plan.thing("pallet", oblong(x, y, 1.2, 0.8, rng.normal(0.0, 0.08)))
        elif what == "tank":
            for x in (0.27 * width, 0.73 * width):
                plan.block(chamfered(x, rng.uniform(0.4, 0.6) * depth, 2.6, 2.6, rng.uniform(0.0, 1.0), 0.75))

    def _annexes(self, plan: Plan, length: float, width: float, rng: np.random.Generator) -> None:
        """Draw offices behind the upper wall, which runs to the left, and gates in the left one."""
        x = rng.uniform(0.0, 0.4) * length
        for room in rng.uniform(4.0, 8.0, int(rng.integers(2, 4))):
            if x + room > length:
                break
            plan.room(box(x, width + 0.3, x + room - 0.2, width + 5.5))
            start = x + rng.uniform(0.3, room - 1.8)
            plan.opening((start + 1.0, width), (start, width), 0.3, door=True)
            plan.thing("desk", oblong(x + 0.5 * room, width + 3.5, 1.8, 0.8, rng.uniform(0.0, 0.3)))
            x += room
        for y in np.arange(rng.uniform(2.0, 6.0), width - 5.0, rng.uniform(9.0, 15.0)):
            plan.recess((0.0, y + 4.0), (0.0, y), 0.4)


def _press(plan: Plan, width: float, depth: float, rng: np.random.Generator) -> None:
    """Draw an L-shaped machine and its bins."""
    a, b = rng.uniform(0.5, 0.8) * width, rng.uniform(0.5, 0.8) * depth
    arm, leg = rng.uniform(1.2, 2.5), rng.uniform(1.2, 2.5)
    corners = np.array([[0.0, 0.0], [a, 0.0], [a, arm], [leg, arm], [leg, b], [0.0, b]])
    plan.at(0.5, 0.5).block(corners)
    for _ in range(int(rng.integers(1, 4))):
        x, y = rng.uniform(leg + 1.5, width - 0.7), rng.uniform(arm + 1.5, depth - 0.7)
        plan.thing("bin", oblong(x, y, 1.2, 0.9, rng.uniform(0.0, 1.5)))


def _robot(plan: Plan, width: float, depth: float, rng: np.random.Generator) -> None:
    """Draw a cell fenced on three sides and part of the fourth, a robot's base and a table in it."""
    a, b = rng.uniform(0.6, 0.95) * width, rng.uniform(0.6, 0.95) * depth
    gate = rng.uniform(1.0, 2.0)
    cell = plan.at(0.2, 0.2)
    cell.block(box(0.0, 0.0, a, FENCE))
    cell.block(box(0.0, FENCE, FENCE, b))
    cell.block(box(a - FENCE, FENCE, a, b))
    cell.block(box(FENCE, b - FENCE, a - FENCE - gate, b))
    cell.block(chamfered(0.4 * a, 0.5 * b, 1.1, 1.1, 0.0, 0.3))
    cell.thing("table", oblong(0.75 * a, rng.uniform(0.35, 0.65) * b, 1.0, 2.0, rng.normal(0.0, 0.1)))
