"""Mines: tunnels between rough pillars, dead ends, no straight wall anywhere."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .plan import Building, Plan
from .shapes import chamfered

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Mine:
    """A room-and-pillar mine; lengths in metres.

    Attributes
    ----------
    pillar : (float, float)
        About the sides of a pillar.
    tunnel : float
        About the width of the tunnels.
    rough : float
        Standard deviation of the walls' corners across the wall.
    step : float
        About the length of a wall between corners.
    """

    pillar: tuple[float, float]
    tunnel: float
    rough: float
    step: float

    @classmethod
    def draw(cls, rng: np.random.Generator) -> Mine:
        """Draw a style."""
        pillar = (rng.uniform(9.0, 15.0), rng.uniform(8.0, 12.0))
        return cls(pillar, rng.uniform(4.0, 5.5), rng.uniform(0.15, 0.35), rng.uniform(1.2, 2.0))

    def build(self, rng: np.random.Generator) -> Building:
        """Draw a mine: how many pillars, where drifts end, how every wall was blasted."""
        plan = Plan()
        columns, rows = int(rng.integers(3, 6)), int(rng.integers(2, 4))
        xs, ys = self._cuts(columns, self.pillar[0], rng), self._cuts(rows, self.pillar[1], rng)
        # Tunnels do not meet at right angles.
        lean = rng.uniform(-0.25, 0.25)
        slant = np.array([[1.0, 0.0], [lean, 1.0]])
        for x0, x1 in zip(xs[1::2], xs[2::2], strict=False):
            for y0, y1 in zip(ys[1::2], ys[2::2], strict=False):
                cut = 0.8
                corners = [(x0 + cut, y0), (x1 - cut, y0), (x1, y0 + cut), (x1, y1 - cut), (x1 - cut, y1),
                           (x0 + cut, y1), (x0, y1 - cut), (x0, y0 + cut)]  # fmt: skip
                plan.block(self._blasted(np.array(corners) @ slant, rng))
        plan.room(self._blasted(self._border(xs, ys, rng) @ slant, rng))
        for _ in range(int(rng.integers(1, 4))):
            x, y = rng.uniform(xs[0] + 3.0, xs[-1] - 3.0), 0.5 * (ys[0] + ys[1])
            place = np.array([x, y]) @ slant
            plan.thing("loader", chamfered(place[0], place[1], rng.uniform(4.0, 7.0), 2.0, 0.0, 0.3))
        return plan.building("mine")

    def _cuts(self, count: int, pillar: float, rng: np.random.Generator) -> Floats:
        """Return where tunnels and pillars begin and end along one axis: tunnel, pillar, ..., tunnel."""
        widths = []
        for _ in range(count):
            widths += [self.tunnel * rng.uniform(0.85, 1.2), pillar * rng.uniform(0.75, 1.3)]
        widths.append(self.tunnel * rng.uniform(0.85, 1.2))
        return np.concatenate([[0.0], np.cumsum(widths)])

    def _border(self, xs: Floats, ys: Floats, rng: np.random.Generator) -> Floats:
        """Return the outermost wall, counter-clockwise, with drifts that go on from the ends of the tunnels."""
        corners: list[tuple[float, float]] = []
        for axis, far, way in ((xs, ys[0], 1), (ys, xs[-1], 1), (xs, ys[-1], -1), (ys, xs[0], -1)):
            along_x = axis is xs
            out = -1.0 if far in (ys[0], xs[0]) else 1.0
            tunnels = list(zip(axis[::2], axis[1::2], strict=False))[1:-1]
            side = [(axis[0], far)] if way > 0 else [(axis[-1], far)]
            for low, high in tunnels[::way]:
                if rng.random() < 0.6:
                    end = far + out * rng.uniform(3.0, 14.0)
                    near = (low, high) if way > 0 else (high, low)
                    side += [(near[0], far), (near[0], end), (near[1], end), (near[1], far)]
            corners += side if along_x else [(b, a) for a, b in side]
        return np.array(corners)

    def _blasted(self, corners: Floats, rng: np.random.Generator) -> Floats:
        """Return a polygon with corners every step or so, each off by some decimetres."""
        points = []
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            length = math.hypot(*(b - a))
            pieces = max(1, round(length / self.step))
            shares = np.arange(pieces) / pieces
            if pieces > 1:
                shares[1:] += rng.uniform(-0.25, 0.25, pieces - 1) / pieces
            points.append(a + shares[:, None] * (b - a))
        stacked = np.vstack(points)
        return np.asarray(stacked + np.clip(rng.normal(0.0, self.rough, stacked.shape), -0.6, 0.6))
