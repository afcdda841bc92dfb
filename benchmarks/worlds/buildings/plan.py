"""Buildings, and paper to draw them on: rooms, openings between them, blocks that stand in them, movable things.

Free space lies on the left of every segment automatically: rooms are drawn counter-clockwise, what stands in them
clockwise. Corners are always given counter-clockwise.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from registration import Segments
from simulation import SimulationError

from .shapes import crosses, edges

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]
Point = tuple[float, float]

SAME = 1e-6  # m; an opening's mouth lies on a wall that is no farther off
SHORTEST = 1e-6  # m; the rest of a wall next to an opening, if longer, stays
FIXED = -1  # in `Building.things`


@dataclass(frozen=True, slots=True)
class Building:
    """A building on the day when its map was made: all doors open, their leaves out of sight.

    Attributes
    ----------
    name : str
        Of its family.
    segments : Segments
        Metres, n of them, with free space on the left.
    things : (n,) int64
        Which thing that can be moved each segment is part of, `FIXED` for none.
    kinds : tuple of str
        The kind of each of those things: "car", "bed", "pallet".
    doors : (k, 4)
        The doorways' leaves when closed: the side of the axis, then the other jamb; metres. An open leaf swings to
        the left of that.
    """

    name: str
    segments: Segments
    things: Indices = field(repr=False)
    kinds: tuple[str, ...] = field(repr=False)
    doors: Floats = field(repr=False)

    @property
    def fixed(self) -> Segments:
        """The segments that are no thing's."""
        return self.segments.take(np.flatnonzero(self.things == FIXED))


@dataclass(frozen=True, slots=True)
class Frame:
    """The transform of a part of a plan: ``p_plan = matrix p_part + shift``.

    Attributes
    ----------
    matrix : (2, 2), a rotation, or a rotation of a mirror image
    shift : (2,) metres
    """

    matrix: Floats
    shift: Floats

    @property
    def mirrored(self) -> bool:
        """Return whether left becomes right."""
        (a, b), (c, d) = self.matrix
        return bool(a * d - b * c < 0.0)

    def apply(self, points: ArrayLike) -> Floats:
        """Take points, ``(k, 2)`` metres, to the plan."""
        return np.asarray(np.asarray(points, dtype=np.float64) @ self.matrix.T + self.shift)


@dataclass(slots=True)
class _Sheet:
    """The drawn segments, in the plan's frame, each an ``(k, 4)`` array."""

    walls: list[Floats] = field(default_factory=list)
    mouths: list[Floats] = field(default_factory=list)
    things: list[tuple[str, Floats]] = field(default_factory=list)
    doors: list[Floats] = field(default_factory=list)


class Plan:
    """A plan, or a part of one that has a frame of its own; all parts draw on the same paper."""

    __slots__ = ("_frame", "_sheet")

    def __init__(self) -> None:
        self._sheet = _Sheet()
        self._frame = Frame(np.eye(2), np.zeros(2))

    def at(self, x: float, y: float, turn: float = 0.0, *, mirrored: bool = False) -> Plan:
        """Return a part of this plan with its origin at ``(x, y)``, turned by `turn` radians.

        With `mirrored` its x axis is turned over first: what is drawn from left to right comes from right to left.
        """
        c, s = math.cos(turn), math.sin(turn)
        matrix = np.array([[c, -s], [s, c]]) @ np.diag([-1.0 if mirrored else 1.0, 1.0])
        part = Plan.__new__(Plan)
        part._sheet = self._sheet
        part._frame = Frame(self._frame.matrix @ matrix, self._frame.apply([x, y]))
        return part

    def room(self, corners: ArrayLike) -> None:
        """Draw a room's walls; it is free inside."""
        self._sheet.walls.append(edges(self._ordered(corners)))

    def block(self, corners: ArrayLike) -> None:
        """Draw what stands in a room and stays there, a pillar, a shaft; it is free outside."""
        self._sheet.walls.append(edges(self._ordered(corners)[::-1]))

    def thing(self, kind: str, corners: ArrayLike) -> None:
        """Draw what stands in a room and can be moved."""
        self._sheet.things.append((kind, edges(self._ordered(corners)[::-1])))

    def wall(self, points: ArrayLike) -> None:
        """Draw an open line of walls through points, free space on its left."""
        p = self._ordered(points)
        self._sheet.walls.append(np.hstack([p[:-1], p[1:]]))

    def opening(self, start: Point, end: Point, depth: float, *, door: bool = False) -> None:
        """Break through a wall to the room behind.

        Parameters
        ----------
        start, end : (float, float)
            On a wall that is drawn from `start` towards `end`, free space on the left: the ends of the opening.
        depth : float
            Thickness of the wall, metres; the room behind begins there.
        door : bool
            True if a leaf hangs in it, on the side of `start`.
        """
        a, b, back_a, back_b = self._passage(start, end, depth)
        self._sheet.walls += [_segment(a, back_a), _segment(back_b, b)]
        self._sheet.mouths += [_segment(a, b), _segment(back_b, back_a)]
        if door:
            self.leaf(start, end)

    def leaf(self, start: Point, end: Point) -> None:
        """Hang a door's leaf into an opening; see `opening`."""
        self._sheet.doors.append(_segment(*self._ordered([start, end])))

    def drawn(self, walls: ArrayLike) -> None:
        """Take over walls that are drawn already, ``(k, 4)`` metres, free space on their left."""
        ends = np.asarray(walls, dtype=np.float64).reshape(-1, 2, 2)
        self._sheet.walls += [_segment(*self._ordered(pair)) for pair in ends]

    def recess(self, start: Point, end: Point, depth: float) -> None:
        """Set back a part of a wall by `depth` metres: a window, a gate, a niche; see `opening`."""
        a, b, back_a, back_b = self._passage(start, end, depth)
        self._sheet.walls += [_segment(a, back_a), _segment(back_a, back_b), _segment(back_b, b)]
        self._sheet.mouths.append(_segment(a, b))

    def building(self, name: str) -> Building:
        """Return what was drawn; a thing that would stand in a wall or in another thing is left out.

        Raises
        ------
        SimulationError
            When the mouth of an opening lies on no wall.
        """
        fixed = np.vstack(self._sheet.walls)
        for mouth in self._sheet.mouths:
            fixed = _cut(fixed, mouth[0])
        standing, owners = fixed, [np.full(len(fixed), FIXED)]
        kinds: list[str] = []
        for kind, outline in self._sheet.things:
            if not crosses(outline, standing):
                owners.append(np.full(len(outline), len(kinds)))
                kinds.append(kind)
                standing = np.vstack([standing, outline])
        doors = np.vstack([np.zeros((0, 4)), *self._sheet.doors])
        return Building(name, Segments.from_array(standing), np.concatenate(owners), tuple(kinds), doors)

    def _ordered(self, points: ArrayLike) -> Floats:
        """Take points to the plan, in an order that keeps their left on the left."""
        p = self._frame.apply(points)
        return p[::-1] if self._frame.mirrored else p

    def _passage(self, start: Point, end: Point, depth: float) -> tuple[Floats, Floats, Floats, Floats]:
        """Return the ends of the mouth in the wall's own direction, and those of the mouth behind."""
        a, b = self._ordered([start, end])
        along = (b - a) / np.hypot(*(b - a))
        behind = depth * np.array([along[1], -along[0]])
        return a, b, a + behind, b + behind


def _segment(begin: Floats, end: Floats) -> Floats:
    return np.concatenate([begin, end])[None]


def _cut(walls: Floats, mouth: Floats) -> Floats:
    """Take an opening out of the wall of the same direction that it lies on."""
    begin, along = mouth[:2], mouth[2:] - mouth[:2]
    width = np.hypot(*along)
    along = along / width
    normal = np.array([-along[1], along[0]])
    near = np.flatnonzero(np.abs((walls[:, :2] - begin) @ normal) < SAME)
    offsets = walls[near].reshape(-1, 2, 2) - begin
    s = offsets @ along
    fits = (np.abs(offsets[:, 1] @ normal) < SAME) & (s[:, 0] < SAME) & (s[:, 1] > width - SAME)
    hosts, s = near[fits], s[fits]
    if len(hosts) == 0:
        raise SimulationError(f"there is no wall from {mouth[:2]} to {mouth[2:]}", argument="opening")
    kept = [np.delete(walls, hosts, axis=0)]
    for (low, high), wall in zip(s, walls[hosts], strict=True):
        if low < -SHORTEST:
            kept.append(np.concatenate([wall[:2], mouth[:2]])[None])
        if high > width + SHORTEST:
            kept.append(np.concatenate([mouth[2:], wall[2:]])[None])
    return np.vstack(kept)
