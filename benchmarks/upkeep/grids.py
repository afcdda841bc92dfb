"""Maps of occupancy grids that a robot drew of a building."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np

from formats import LineMap, read_map
from registration import Segments
from simulation import Scanner, free_place, scan

CELL = 0.05  # m
PLACES = 150
MAPPER = Scanner.over(math.tau, 1440, range_max=25.0, sigma=0.0)
FREE, OCCUPIED, UNKNOWN = 254, 0, 205  # as map_saver writes them
NEAR, PARALLEL = 0.15, 0.99  # m, cosine


def grid_map(walls: Segments, rng: np.random.Generator) -> LineMap:
    """Return the line map of a grid of a building: beams from many places clear cells, and occupy those they end in."""
    low = walls.endpoints.reshape(-1, 2).min(axis=0) - 1.0
    columns, rows = np.ceil((walls.endpoints.reshape(-1, 2).max(axis=0) + 1.0 - low) / CELL).astype(int)
    cells = np.full((rows, columns), UNKNOWN, dtype=np.uint8)
    ends: list[np.ndarray] = []
    for _ in range(PLACES):
        at = free_place(walls, rng)
        seen = scan(walls, at, MAPPER)
        ranges = np.minimum(seen.true_ranges, MAPPER.range_max)
        angles = MAPPER.angles + at.theta
        steps = np.arange(0.0, float(ranges.max()), 0.5 * CELL)
        rays, along = np.nonzero(steps[None, :] < ranges[:, None] - 0.25 * CELL)
        x, y = at.x + steps[along] * np.cos(angles[rays]), at.y + steps[along] * np.sin(angles[rays])
        column, row = ((x - low[0]) / CELL).astype(int), ((y - low[1]) / CELL).astype(int)
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)  # a street is open at its ends
        cells[row[inside], column[inside]] = FREE
        hit = np.flatnonzero(seen.true_ranges < MAPPER.range_max)
        far = seen.true_ranges[hit] + 1e-3
        ends.append(np.stack([at.x + far * np.cos(angles[hit]), at.y + far * np.sin(angles[hit])], axis=1))
    hits = ((np.concatenate(ends) - low) / CELL).astype(int)
    cells[hits[:, 1], hits[:, 0]] = OCCUPIED
    with tempfile.TemporaryDirectory() as folder:
        picture, yaml = Path(folder) / "map.pgm", Path(folder) / "map.yaml"
        picture.write_bytes(f"P5 {columns} {rows} 255\n".encode() + cells[::-1].tobytes())
        yaml.write_text(
            f"image: map.pgm\nresolution: {CELL}\norigin: [{low[0]}, {low[1]}, 0]\nnegate: 0\n"
            "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
        )
        return read_map(yaml).map


def errors(ends: np.ndarray, truth: Segments) -> np.ndarray:
    """Return how far segments are from the true lines, the root mean square along each, metres; nan where none is near.

    Corresponding walls face the same way, and are the nearest ones.
    """
    out = np.full(len(ends), np.nan)
    for k, (x1, y1, x2, y2) in enumerate(ends):
        length = math.hypot(x2 - x1, y2 - y1)
        same = np.flatnonzero(truth.directions @ (np.array([x2 - x1, y2 - y1]) / length) >= PARALLEL)
        points = np.array([[x1, y1], [0.5 * (x1 + x2), 0.5 * (y1 + y2)], [x2, y2]])
        off = points @ truth.normals[same].T - truth.offsets[same]
        along = (points[1] - truth.endpoints[same, :2]) * truth.directions[same]
        beside = (along.sum(axis=1) >= -NEAR) & (along.sum(axis=1) <= truth.lengths[same] + NEAR)
        square = np.where(beside, np.array([1.0, 4.0, 1.0]) @ off**2 / 6.0, np.inf)
        if len(square) and square.min() <= NEAR**2:
            out[k] = math.sqrt(float(square.min()))
    return out
