"""A matcher for occupancy grids: branch and bound over all poses, as Hess et al. 2016 describe it for Cartographer.

A stand-in of our own for what users of grids would use instead, written from the paper: W. Hess, D. Kohler, H. Rapp,
D. Andor, *Real-Time Loop Closure in 2D LIDAR SLAM*, ICRA 2016. The score of a pose is the mean likelihood of the
measured points, 0 to 1. The matcher returns the best pose of all free cells and headings, and the best one elsewhere.

Two departures make it faster and leave the result as it is: a bound is given up as soon as the points that are left
cannot reach what is needed, and what is needed starts high and is lowered until there is a pose.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from registration import RigidTransform

Floats = NDArray[np.float64]
Likelihoods = NDArray[np.float32]
Cells = NDArray[np.int32]

SIGMA = 0.08  # m; standard deviation of a point's distance to the nearest occupied cell
LEVELS = 7  # of the pyramid; the highest has blocks of 64 cells
POINTS = 150  # of a scan at most, one of each square
SQUARES = (0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5)  # m; the first of these sizes that leaves so few
NEEDED = (0.9, 0.8, 0.7, 0.6, 0.5, 0.4)  # scores that are tried one after the other; the last is that of a match
APART = (0.5, math.radians(10.0))  # m and rad; of a pose elsewhere
# Gates of an answer that a robot would use, chosen before the comparison.
USABLE_SCORE, USABLE_LEAD = 0.55, 0.06


@dataclass(frozen=True, slots=True)
class GridMatch:
    """The result for one scan.

    Attributes
    ----------
    pose : RigidTransform or None
        map_from_scan; None where no pose reaches the last of `NEEDED`.
    score : float
        0 to 1.
    lead : float
        Over the best pose elsewhere, up to `USABLE_LEAD`.
    """

    pose: RigidTransform | None
    score: float
    lead: float

    @property
    def usable(self) -> bool:
        """Return whether score and lead reach their thresholds."""
        return self.pose is not None and self.score >= USABLE_SCORE and self.lead >= USABLE_LEAD


class GridMatcher:
    """A grid, prepared for searches.

    Parameters
    ----------
    occupied, free : (rows, columns) bool
        Row 0 is the lowest. The sensor stands in a free cell.
    resolution : float
        Edge of a cell, metres.
    origin : RigidTransform
        map_from_grid: of the lower left corner.
    """

    def __init__(
        self, occupied: NDArray[np.bool_], free: NDArray[np.bool_], resolution: float, origin: RigidTransform
    ) -> None:
        self.resolution, self.origin = resolution, origin
        distance = ndimage.distance_transform_edt(~occupied) * resolution
        self.pyramid = _pyramid(np.exp(-0.5 * (distance / SIGMA) ** 2).astype(np.float32))
        self.free = _pyramid(free.astype(np.float32)) > 0.0

    def match(self, angles: Floats, ranges: Floats) -> GridMatch:
        """Search all poses for a scan: `angles` and `ranges` (n,) of its returns, rad and metres."""
        points = _spread(ranges[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1))
        if not len(points):
            return GridMatch(None, 0.0, 0.0)
        # The farthest point moves by one cell from a heading to the next.
        step = self.resolution / float(np.hypot(*points.T).max())
        headings = np.arange(0.0, math.tau, step)
        offsets = self._offsets(points, headings)
        best = next((one for one in (self._search(offsets, needed, None) for needed in NEEDED) if one), None)
        if best is None:
            return GridMatch(None, 0.0, 0.0)
        score, heading, row, column = best
        other = self._search(offsets, score - USABLE_LEAD, (heading, row, column, step))
        lead = score - other[0] if other is not None else USABLE_LEAD
        place = RigidTransform(
            (column + 0.5) * self.resolution, (row + 0.5) * self.resolution, float(headings[heading])
        )
        return GridMatch(self.origin.compose(place), score, lead)

    def _offsets(self, points: Floats, headings: Floats) -> Cells:
        """Return the cells of the points from that of the sensor, (headings, points, 2): row, column."""
        c, s = np.cos(headings)[:, None], np.sin(headings)[:, None]
        x, y = c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1]
        return np.round(np.stack([y, x], axis=2) / self.resolution).astype(np.int32)

    def _search(
        self, offsets: Cells, least: float, apart: tuple[int, int, int, float] | None
    ) -> tuple[float, int, int, int] | None:
        """Return score, heading, row and column of the best pose above `least`, apart from a given one."""
        heading, row, column, step = apart or (-1, 0, 0, 1.0)
        near = APART[0] / self.resolution, APART[1] / step
        found = _branch_and_bound(self.pyramid, self.free, offsets, least, (heading, row, column), near)
        return None if found[1] < 0 else found


def _spread(points: Floats) -> Floats:
    """Return one point of each square, so that near surfaces count no more than far ones; in a random order."""
    chosen = np.arange(len(points))
    for size in SQUARES:
        chosen = np.unique(np.floor(points / size), axis=0, return_index=True)[1]
        if len(chosen) <= POINTS:
            break
    shuffled: Floats = points[np.random.default_rng(0).permutation(chosen)]
    return shuffled


def _pyramid(likelihoods: Likelihoods) -> Likelihoods:
    """Return (levels, rows, columns): on level k the greatest value of the 2^k by 2^k cells up and to the right."""
    levels = [likelihoods]
    for k in range(1, LEVELS):
        half, below = 1 << (k - 1), levels[-1]
        wide = below.copy()
        wide[:, :-half] = np.maximum(below[:, :-half], below[:, half:])
        high = wide.copy()
        high[:-half] = np.maximum(wide[:-half], wide[half:])
        levels.append(high)
    return np.stack(levels)


@numba.njit(cache=True)
def _mean_at(level: Any, offsets: Any, row: int, column: int, size: int, needed: float) -> float:
    """Return the mean value of a level at the points of one heading, a bound for the block of poses from a cell on.

    -1 if it is at most `needed`.
    """
    rows, columns = level.shape
    total = 0.0
    least = needed * len(offsets)
    for k in range(len(offsets)):
        if total + (len(offsets) - k) <= least:
            return -1.0
        r, c = row + offsets[k, 0], column + offsets[k, 1]
        # A block that reaches into the grid from the left or from below: its first cell inside bounds the rest.
        if r < 0 and r + size > 0:
            r = 0
        if c < 0 and c + size > 0:
            c = 0
        if 0 <= r < rows and 0 <= c < columns:
            total += level[r, c]
    return total / len(offsets)


@numba.njit(cache=True)
def _branch_and_bound(
    pyramid: Any, free: Any, offsets: Any, least: float, apart: Any, near: Any
) -> tuple[float, int, int, int]:
    """Search depth first, the blocks of the highest level in the order of their bounds."""
    levels, rows, columns = pyramid.shape
    size = 1 << (levels - 1)
    down, across = -(-rows // size), -(-columns // size)
    bounds = np.empty(len(offsets) * down * across, np.float32)
    for h in range(len(offsets)):
        for block in range(down * across):
            row, column = block // across * size, block % across * size
            bound = -1.0
            if free[levels - 1, row, column]:
                bound = _mean_at(pyramid[levels - 1], offsets[h], row, column, size, least)
            bounds[h * down * across + block] = bound
    best = (least, -1, 0, 0)
    stack_bounds = np.empty(4 * levels + 4)
    stack = np.empty((4 * levels + 4, 3), np.int64)
    for start in np.argsort(-bounds):
        if bounds[start] <= best[0]:
            break
        h, block = start // (down * across), start % (down * across)
        stack_bounds[0] = bounds[start]
        stack[0] = (levels - 1, block // across * size, block % across * size)
        filled = 1
        while filled > 0:
            filled -= 1
            bound, level, row, column = stack_bounds[filled], stack[filled, 0], stack[filled, 1], stack[filled, 2]
            if bound <= best[0]:
                continue
            if level == 0:
                turned = abs(h - apart[0])
                turned = min(turned, len(offsets) - turned)
                here = apart[0] >= 0 and turned <= near[1]
                if not (here and math.hypot(row - apart[1], column - apart[2]) <= near[0]):
                    best = (bound, h, row, column)
                continue
            half = 1 << (level - 1)
            begin = filled
            for quarter in range(4):
                r, c = row + quarter // 2 * half, column + quarter % 2 * half
                if r >= rows or c >= columns or not free[level - 1, r, c]:
                    continue
                value = _mean_at(pyramid[level - 1], offsets[h], r, c, half, best[0])
                if value <= best[0]:
                    continue
                # The greatest bound comes last, and is looked at first.
                place = filled
                while place > begin and stack_bounds[place - 1] > value:
                    stack_bounds[place] = stack_bounds[place - 1]
                    stack[place] = stack[place - 1]
                    place -= 1
                stack_bounds[place] = value
                stack[place] = (level - 1, r, c)
                filled += 1
    return best
