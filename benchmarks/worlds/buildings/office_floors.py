"""Office floors, drawn by `simulation.offices`, with desks and doors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from simulation import OfficePlan, offices

from .plan import Building, Plan
from .shapes import oblong

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class OfficeFloors:
    """Offices of one owner; lengths in metres.

    Attributes
    ----------
    room_width : (float, float)
        Least and greatest; near to each other in a building that repeats itself.
    depth, corridor_width : float
    tidy : bool
        True if every desk stands in the middle of its room, and nothing else.
    """

    room_width: tuple[float, float]
    depth: float
    corridor_width: float
    tidy: bool

    @classmethod
    def draw(cls, rng: np.random.Generator) -> OfficeFloors:
        """Draw a style."""
        low, tidy = rng.uniform(2.5, 3.5), bool(rng.random() < 0.5)
        width = (low, low if tidy else low + rng.uniform(0.0, 3.0))
        return cls(width, rng.uniform(4.0, 5.5), rng.uniform(1.6, 2.4), tidy)

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a floor: how many corridors and rooms, how wide, where doors and desks are."""
        layout = OfficePlan(
            rooms=int(rng.integers(5, 10)), corridors=int(rng.integers(1, 4)), room_width=self.room_width,
            depth=self.depth, corridor_width=self.corridor_width,
        )  # fmt: skip
        world = offices(rng, layout)
        plan = Plan()
        plan.drawn(world.segments.endpoints)
        # Its poses come two by two: in the middle of a room, and in the corridor before the room's door.
        for room, before in zip(world.poses[::2], world.poses[1::2], strict=True):
            side = math.copysign(1.0, room.y - before.y)
            part = plan.at(before.x, before.y + side * (0.5 * layout.corridor_width + layout.wall),
                           0.0 if side > 0.0 else math.pi)  # fmt: skip
            part.leaf((-0.5 * layout.door_width, 0.0), (0.5 * layout.door_width, 0.0))
            if self.tidy:
                plan.thing("desk", oblong(room.x, room.y, 1.6, 0.8))
                continue
            x, y = room.x + rng.uniform(-0.15, 0.15), room.y + rng.uniform(-0.6, 0.6)
            plan.thing("desk", oblong(x, y, 1.6, 0.8, float(rng.choice([0.0, 0.5 * math.pi]))))
            if rng.random() < 0.6:
                y = room.y + side * (0.5 * layout.depth - 0.3)
                plan.thing("cabinet", oblong(room.x + rng.uniform(-0.3, 0.3), y, rng.uniform(0.8, 1.4), 0.45))
        return plan.building("offices")
