"""Flats: the same one again and again on both sides of party walls, and floors where no two are alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .corridors import corridor, door, rooms_along
from .plan import Building, Plan
from .shapes import box, oblong

PARTY = 0.3  # m; wall between flats
INNER = 0.12  # m; wall between rooms
DOOR = 0.85  # m

Room = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class MirroredFlats:
    """Rows of flats, two to a stairwell, each pair a mirror image; lengths in metres.

    Attributes
    ----------
    size : (float, float)
        Of a flat, along the row and across it.
    living : float
        Width of the living room; the kitchen has the rest.
    front, hall : float
        Depth of the rooms in front and of the hall behind them.
    stairs : float
        Width of a stairwell.
    tidy : bool
        True if the furniture stands alike in all flats, as holiday homes have it.
    """

    size: tuple[float, float]
    living: float
    front: float
    hall: float
    stairs: float
    tidy: bool

    @classmethod
    def draw(cls, rng: np.random.Generator) -> MirroredFlats:
        """Draw a style."""
        size = (rng.uniform(8.5, 11.0), rng.uniform(9.0, 11.5))
        return cls(size, rng.uniform(0.5, 0.56) * size[0], rng.uniform(3.8, 4.6), rng.uniform(1.3, 1.7),
                   rng.uniform(2.4, 3.0), bool(rng.random() < 0.4))  # fmt: skip

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a floor: how many stairwells, what furniture people have."""
        plan = Plan()
        step = 2.0 * self.size[0] + self.stairs + 3.0 * PARTY
        for k in range(int(rng.integers(2, 5))):
            x = k * step
            plan.room(box(x, 0.0, x + self.stairs, self.size[1]))
            plan.block(box(x + 0.45 * self.stairs, 2.2, x + 0.55 * self.stairs, self.size[1] - 2.5))
            for flat in (plan.at(x + self.stairs + PARTY, 0.0), plan.at(x - PARTY, 0.0, mirrored=True)):
                self._flat(flat, rng)
        return plan.building("mirrored_flats")

    def _flat(self, plan: Plan, rng: np.random.Generator) -> None:
        """Draw a flat whose party wall to the stairs is on the left: two rooms in front, three behind the hall."""
        width, depth = self.size
        low, high = self.front + INNER, self.front + INNER + self.hall
        bath = 0.76 * width
        rooms = [
            (0.0, 0.0, self.living, self.front), (self.living + INNER, 0.0, width, self.front),
            (0.0, low, bath - INNER, high), (bath, low, width, high + 0.9),
            (0.0, high + INNER, 0.5 * width, depth), (0.5 * width + INNER, high + INNER, bath - INNER, depth),
        ]  # fmt: skip
        for room in rooms:
            plan.room(box(*room))
        plan.room(box(bath, high + 0.9 + INNER, width, depth))
        plan.opening((0.0, low + 1.1), (0.0, low + 0.2), PARTY, door=True)
        for x, y, way in ((0.3, low, 1.0), (self.living + INNER + 0.2, low, 1.0),
                          (0.5, high, -1.0), (0.5 * width + INNER + 0.2, high, -1.0)):  # fmt: skip
            # Rooms in front open through the hall's lower wall, those behind through its upper one.
            ends = ((x, y), (x + DOOR, y)) if way > 0.0 else ((x + DOOR, y), (x, y))
            plan.opening(*ends, INNER, door=True)
        plan.opening((bath - INNER, low + 0.3), (bath - INNER, low + 1.1), INNER, door=True)
        start = high + 0.9 + INNER + 0.3
        plan.opening((bath - INNER, start), (bath - INNER, start + DOOR), INNER, door=True)
        furniture = [
            ("sofa", (self.living - 0.6, 0.45 * self.front, 0.9, 2.0)), ("table", (0.35 * self.living, 1.2, 1.4, 0.8)),
            ("kitchen", (width - 0.35, 0.5 * self.front, 0.6, 2.4)), ("bed", (1.1, depth - 1.2, 1.7, 2.0)),
            ("wardrobe", (0.5 * width - 0.35, depth - 1.4, 0.6, 1.8)), ("bath", (width - 0.4, high + 0.1, 0.75, 1.5)),
            ("cot", (0.5 * (0.5 * width + bath), depth - 0.6, 1.2, 0.7)),
        ]  # fmt: skip
        for kind, (x, y, long, deep) in furniture:
            if self.tidy:
                plan.thing(kind, oblong(x, y, long, deep))
            elif rng.random() < 0.85:
                plan.thing(kind, oblong(x + rng.uniform(-0.04, 0.04), y + rng.uniform(-0.2, 0.2), long, deep))


@dataclass(frozen=True, slots=True)
class Apartments:
    """A floor of different flats along a short corridor; lengths in metres.

    Attributes
    ----------
    room : float
        About the area of a room, square metres.
    depth : float
        Of the flats.
    corridor : float
        Its width.
    """

    room: float
    depth: float
    corridor: float

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Apartments:
        """Draw a style."""
        return cls(rng.uniform(10.0, 16.0), rng.uniform(7.0, 11.0), rng.uniform(1.4, 2.0))

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a floor: how many flats, how each is parted, what furniture stands along its walls."""
        plan = Plan()
        rows = [rng.uniform(7.0, 13.0, int(rng.integers(1, 4))) + PARTY for _ in range(2)]
        length = max(float(widths.sum()) for widths in rows) - PARTY
        for row, widths in zip(corridor(plan, length, self.corridor), rows, strict=True):
            for part, width in rooms_along(row, list(widths), PARTY):
                self._flat(part, width, rng)
        return plan.building("apartments")

    def _flat(self, plan: Plan, width: float, rng: np.random.Generator) -> None:
        """Part a flat into rooms, joined by doors, one of them with the entrance."""
        doors: list[tuple[float, float]] = []
        rooms = self._parted(plan, (0.0, 0.0, width, self.depth * rng.uniform(0.85, 1.0)), doors, rng)
        fronts = [r for r in rooms if r[1] == 0.0 and r[2] - r[0] > DOOR + 0.4]
        entrance = fronts[int(rng.integers(len(fronts)))]
        start = rng.uniform(entrance[0] + 0.2, entrance[2] - 0.2 - DOOR)
        door(plan, start, DOOR, PARTY)
        doors.append((start + 0.5 * DOOR, 0.0))
        for room in rooms:
            plan.room(box(*room))
            _furnish(plan, room, doors, rng)

    def _parted(
        self, plan: Plan, space: Room, doors: list[tuple[float, float]], rng: np.random.Generator
    ) -> list[Room]:
        """Part a space by walls until its rooms are small, and hang a door in each wall."""
        x0, y0, x1, y1 = space
        across = x1 - x0 > y1 - y0
        low, high = (x0, x1) if across else (y0, y1)
        if (x1 - x0) * (y1 - y0) < self.room * rng.uniform(0.8, 2.0) or high - low < 3.8:
            return [space]
        at = rng.uniform(max(low + 1.7, 0.65 * low + 0.35 * high), min(high - 1.7, 0.35 * low + 0.65 * high))
        a, b = at - 0.5 * INNER, at + 0.5 * INNER
        first = self._parted(plan, (x0, y0, a, y1) if across else (x0, y0, x1, a), doors, rng)
        second = self._parted(plan, (b, y0, x1, y1) if across else (x0, b, x1, y1), doors, rng)
        near = [(r[1], r[3]) if across else (r[0], r[2]) for r in first if (r[2] if across else r[3]) == a]
        far = [(r[1], r[3]) if across else (r[0], r[2]) for r in second if (r[0] if across else r[1]) == b]
        shared = [(max(n[0], f[0]) + 0.15, min(n[1], f[1]) - 0.15) for n in near for f in far]
        shared = [s for s in shared if s[1] - s[0] > DOOR]
        start, end = shared[int(rng.integers(len(shared)))]
        start = rng.uniform(start, end - DOOR)
        if across:
            plan.opening((a, start), (a, start + DOOR), INNER, door=True)
        else:
            plan.opening((start + DOOR, a), (start, a), INNER, door=True)
        doors.append((at, start + 0.5 * DOOR) if across else (start + 0.5 * DOOR, at))
        return first + second


def _furnish(plan: Plan, room: Room, doors: Sequence[tuple[float, float]], rng: np.random.Generator) -> None:
    """Put furniture along a room's walls, away from its doors."""
    x0, y0, x1, y1 = room
    for _ in range(int(rng.integers(1, 4))):
        long, deep = rng.uniform(0.8, min(2.0, 0.6 * min(x1 - x0, y1 - y0))), rng.uniform(0.35, 0.6)
        side = int(rng.integers(4))
        if side % 2:
            long, deep = deep, long
        x = rng.uniform(x0 + 0.5 * long + 0.05, x1 - 0.5 * long - 0.05) if side % 2 == 0 else (
            x1 - 0.5 * long - 0.03 if side == 1 else x0 + 0.5 * long + 0.03)  # fmt: skip
        y = rng.uniform(y0 + 0.5 * deep + 0.05, y1 - 0.5 * deep - 0.05) if side % 2 else (
            y0 + 0.5 * deep + 0.03 if side == 0 else y1 - 0.5 * deep - 0.03)  # fmt: skip
        if all(abs(x - a) > 0.5 * long + 0.7 or abs(y - b) > 0.5 * deep + 0.7 for a, b in doors):
            plan.thing("furniture", oblong(x, y, long, deep))
