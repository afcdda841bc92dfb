"""Twins of the kernels that build a map index."""

from __future__ import annotations

import math

import numpy as np

from association.layout import Integers
from registration.layout import Floats, Records

from .geometry import point


def collinear_groups(ends: Floats, max_gap: float, max_lateral: float, max_angle: float) -> list[int]:
    """Compare every piece with the begin of every other; label by the lowest index that links lead to.

    One that begins along another has to end next to its line, too.
    """
    count = len(ends)
    label = list(range(count))
    turns = np.arctan2(ends[:, 3] - ends[:, 1], ends[:, 2] - ends[:, 0])
    for i in range(count):
        d = np.array([math.cos(turns[i]), math.sin(turns[i])])
        for j in range(count):
            begin, end = ends[j, :2] - ends[i, 2:], ends[j, 2:] - ends[i, 2:]
            length, along = math.dist(ends[i, :2], ends[i, 2:]), begin @ d
            aside, beyond = (abs(gap @ [-d[1], d[0]]) for gap in (begin, end))
            turn = abs(math.remainder(turns[j] - turns[i], math.tau))
            continues = abs(along) <= max_gap
            repeats = -length - max_gap <= along <= max_gap and beyond <= max_lateral
            if i != j and (continues or repeats) and aside <= max_lateral and turn <= max_angle:
                one, other = sorted((label[i], label[j]))
                label = [one if value == other else value for value in label]
    return label


def cells_near(end: Floats, radius: float, shape: Records) -> list[int]:
    """List the cells of a grid that a segment comes within `radius` of, or nearly: column by column.

    In each the part of the segment that lies within `radius` of the column, or its nearer end, reaches `radius` up and
    down.
    """
    grid = shape[0]
    corner, size = point(grid, "x0", "y0"), float(grid["cell"])
    found = []
    for column in range(grid["columns"]):
        left = corner[0] + column * size
        if max(end[0], end[2]) < left - radius or min(end[0], end[2]) > left + size + radius:
            continue
        span = end[2] - end[0]
        if abs(span) < 1e-9:
            heights = end[[1, 3]]
        else:
            shares = np.clip((np.array([left - radius, left + size + radius]) - end[0]) / span, 0.0, 1.0)
            heights = end[1] + shares * (end[3] - end[1])
        low, high = heights.min() - radius - corner[1], heights.max() + radius - corner[1]
        rows = range(max(0, math.floor(low / size)), min(grid["rows"] - 1, math.floor(high / size)) + 1)
        found += [row * int(grid["columns"]) + column for row in rows]
    return found


def grid_cells(ends: Floats, radius: float, shape: Records) -> list[list[int]]:
    """List for every cell the segments that come near it."""
    lists: list[list[int]] = [[] for _ in range(shape[0]["columns"] * shape[0]["rows"])]
    for i, end in enumerate(ends):
        for cell in cells_near(end, radius, shape):
            lists[cell].append(i)
    return lists


def direction_raster(ends: Floats, radius: float, shape: Records, sectors: Integers) -> list[int]:
    """Set the bits of the sectors one by one."""
    return [sum({1 << int(sectors[i]) for i in listed}) for listed in grid_cells(ends, radius, shape)]


def distance_to_cell(end: Floats, cell: int, shape: Records) -> float:
    """Return the least distance of a segment from a cell, metres, by many points along it."""
    grid = shape[0]
    row, column = divmod(cell, int(grid["columns"]))
    low = point(grid, "x0", "y0") + grid["cell"] * np.array([column, row])
    points = end[:2] + np.linspace(0.0, 1.0, 501)[:, None] * (end[2:] - end[:2])
    beyond = np.maximum(0.0, np.maximum(low - points, points - low - grid["cell"]))
    return float(np.hypot(beyond[:, 0], beyond[:, 1]).min())
