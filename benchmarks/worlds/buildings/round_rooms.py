"""Round rooms: rotundas in a row, smaller ones about them, straight passages between."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from .plan import Building, Plan
from .shapes import arc, oblong, ring

APART = 0.6  # m; least wall between two rooms


@dataclass(frozen=True, slots=True)
class Rotunda:
    """A round room: centre and radius in metres."""

    x: float
    y: float
    radius: float


@dataclass(frozen=True, slots=True)
class RoundRooms:
    """A building of round rooms; lengths in metres.

    Attributes
    ----------
    radius : (float, float)
        Of the large rooms and of the small ones.
    passage : float
        Width.
    side : float
        About the length of a wall: circles are drawn as polygons.
    furnished : bool
        True if there are benches and altars.
    """

    radius: tuple[float, float]
    passage: float
    side: float
    furnished: bool

    @classmethod
    def draw(cls, rng: np.random.Generator) -> RoundRooms:
        """Draw a style."""
        radius, furnished = (rng.uniform(5.0, 8.0), rng.uniform(2.4, 3.8)), bool(rng.random() < 0.6)
        return cls(radius, rng.uniform(1.4, 2.2), rng.uniform(0.7, 1.5), furnished)

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a building: how many rooms, where the small ones are, what stands in them."""
        plan = Plan()
        rooms, passages = self._layout(rng)
        towards: list[list[float]] = [[] for _ in rooms]
        for a, b in passages:
            bearing = math.atan2(rooms[b].y - rooms[a].y, rooms[b].x - rooms[a].x)
            towards[a].append(bearing)
            towards[b].append(bearing + math.pi)
            self._passage(plan.at(rooms[a].x, rooms[a].y, bearing), rooms[a], rooms[b])
        for room, bearings in zip(rooms, towards, strict=True):
            self._walls(plan.at(room.x, room.y), room, sorted(b % math.tau for b in bearings))
            self._furnish(plan.at(room.x, room.y), room, rng)
        return plan.building("round_rooms")

    def _layout(self, rng: np.random.Generator) -> tuple[list[Rotunda], list[tuple[int, int]]]:
        """Return the rooms, and the pairs of them that a passage joins."""
        rooms, passages = [Rotunda(0.0, 0.0, self.radius[0])], []
        bearing = rng.uniform(-math.pi, math.pi)
        for k in range(1, int(rng.integers(2, 5))):
            before, radius = rooms[k - 1], self.radius[0] * float(rng.choice([1.0, 1.0, 1.3]))
            distance = before.radius + radius + rng.uniform(3.0, 9.0)
            x, y = before.x + distance * math.cos(bearing), before.y + distance * math.sin(bearing)
            rooms.append(Rotunda(x, y, radius))
            passages.append((k - 1, k))
            bearing += rng.uniform(-0.5, 0.5)
        for host in range(len(rooms)):
            # Chapels at a fixed step about each rotunda, as far as there is room.
            steps = int(rng.integers(6, 11))
            for step in np.flatnonzero(rng.random(steps) < 0.7):
                at = step * math.tau / steps
                distance = rooms[host].radius + self.radius[1] + rng.choice([0.8, 2.0])
                x, y = rooms[host].x + distance * math.cos(at), rooms[host].y + distance * math.sin(at)
                chapel = Rotunda(x, y, self.radius[1])
                if self._fits(chapel, rooms, passages):
                    passages.append((host, len(rooms)))
                    rooms.append(chapel)
        return rooms, passages

    def _fits(self, chapel: Rotunda, rooms: list[Rotunda], passages: list[tuple[int, int]]) -> bool:
        """Tell whether a room keeps clear of the others and of the passages."""
        need = chapel.radius + APART
        if any(math.hypot(chapel.x - r.x, chapel.y - r.y) < need + r.radius for r in rooms):
            return False
        here = np.array([chapel.x, chapel.y])
        for a, b in passages:
            start, end = (np.array([rooms[k].x, rooms[k].y]) for k in (a, b))
            along = np.clip((here - start) @ (end - start) / np.sum((end - start) ** 2), 0.0, 1.0)
            if math.hypot(*(here - start - along * (end - start))) < need + 0.5 * self.passage:
                return False
        return True

    def _passage(self, plan: Plan, near: Rotunda, far: Rotunda) -> None:
        """Draw the two walls of a passage along x, from the near room about the origin to the far one."""
        half = 0.5 * self.passage
        distance = math.hypot(far.x - near.x, far.y - near.y)
        start = math.sqrt(near.radius**2 - half**2)
        end = distance - math.sqrt(far.radius**2 - half**2)
        plan.wall([(start, -half), (end, -half)])
        plan.wall([(end, half), (start, half)])

    def _walls(self, plan: Plan, room: Rotunda, bearings: list[float]) -> None:
        """Draw a round wall about the origin, open towards the passages."""
        half = math.asin(0.5 * self.passage / room.radius)
        for k, bearing in enumerate(bearings):
            following = bearings[(k + 1) % len(bearings)] + (math.tau if k == len(bearings) - 1 else 0.0)
            start, end = bearing + half, following - half
            if end > start:
                sides = max(1, round((end - start) * room.radius / self.side))
                plan.wall(arc(0.0, 0.0, room.radius, start, end, sides))

    def _furnish(self, plan: Plan, room: Rotunda, rng: np.random.Generator) -> None:
        """Put columns or a table into a large room, an altar into a small one."""
        if room.radius < 4.5:
            if self.furnished and rng.random() < 0.7:
                x, y = rng.uniform(-0.4, 0.4, 2) * room.radius
                plan.thing("altar", oblong(x, y, 1.2, 0.6, rng.uniform(0.0, 3.0)))
            return
        if rng.random() < 0.5:
            count, first = int(rng.integers(5, 9)), rng.uniform(0.0, 1.0)
            for k in range(count):
                at = first + k * math.tau / count
                radius = 0.62 * room.radius
                plan.block(ring(radius * math.cos(at), radius * math.sin(at), 0.3, 8))
        for _ in range(int(rng.integers(1, 5)) if self.furnished else 0):
            x, y = rng.uniform(-0.35, 0.35, 2) * room.radius
            plan.thing("bench", oblong(x, y, 1.8, 0.5, rng.uniform(0.0, 3.0)))
