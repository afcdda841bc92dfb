"""Scans of known poses for the public grids: simulated in their cells, or from the log of the same building."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from formats import read_log
from formats.grids.cells import FREE, OCCUPIED, UNKNOWN, Cells, Grid, classify
from formats.grids.map_server import read_grid
from formats.options import DEFAULT_OPTIONS
from formats.report import Notes
from registration import RigidTransform, Segments
from simulation import Scanner, scan
from vectorization import LaserScan

from .queries import DATA

Floats = NDArray[np.float64]

GRIDS = ("freiburg_052", "freiburg_079", "intel", "movecare_home1", "uma_236", "willow_2010")
LOG_OF = {"intel": "intel", "freiburg_079": "freiburg-079"}
SCANNER = Scanner(sigma=0.0)  # noise is added behind the border of the cells
SIGMA = 0.02  # m
CLEARANCE = 0.45  # m
SEED = 20190901


@dataclass(frozen=True, slots=True)
class PosedScan:
    """A scan and where it was taken, map_from_scan; of a log in the log's own frame."""

    pose: RigidTransform
    laser: LaserScan


def grid_path(name: str) -> Path:
    """Return where a grid's description is."""
    return DATA / "gridmaps" / f"{name}.yaml"


def load_cells(name: str) -> tuple[Grid, Cells]:
    """Read a grid as the importer does: what is free, occupied and not known has no other witness."""
    grid, _ = read_grid(grid_path(name), DEFAULT_OPTIONS, Notes())
    return grid, classify(grid, Notes())


def simulated(name: str, count: int, *, middle: bool) -> list[PosedScan]:
    """Take scans all over the largest free room of a grid.

    A beam that meets an occupied cell ends in the middle of its way through it, or where it enters; one that meets
    what is not known tells nothing.

    Parameters
    ----------
    name : str
    count : int
    middle : bool
        True if beams end in the middle of a cell, as the returns did that made it occupied.
    """
    grid, cells = load_cells(name)
    walls, unknown = (_borders(cells, kind) for kind in (OCCUPIED, UNKNOWN))
    rng = np.random.default_rng(SEED)
    labels, _ = ndimage.label(cells == FREE)
    largest = int(np.argmax(np.bincount(labels.ravel())[1:])) + 1
    clear = ndimage.distance_transform_edt(cells == FREE) * grid.resolution
    rows, columns = np.nonzero((labels == largest) & (clear > CLEARANCE))
    all_borders = Segments.from_array(np.vstack([walls, unknown]) * grid.resolution)
    found = []
    for k in rng.integers(len(rows), size=count):
        x, y = (np.array([columns[k], rows[k]]) + rng.random(2)) * grid.resolution
        inside = RigidTransform(float(x), float(y), float(rng.uniform(-math.pi, math.pi)))
        seen = scan(all_borders, inside, SCANNER, rng)
        ranges = seen.ranges.copy()
        hit = np.isfinite(ranges)
        if middle:
            ranges[hit] += 0.5 * _chords(inside, seen.angles[hit], ranges[hit], grid.resolution)
        ranges[hit] += rng.normal(0.0, SIGMA, int(hit.sum()))
        ranges[hit & (seen.hits >= len(walls))] = np.nan
        laser = LaserScan(SCANNER.angle_min, SCANNER.angle_increment, ranges, 0.0, SCANNER.range_max)
        found.append(PosedScan(grid.origin.compose(inside), laser))
    return found


def _borders(cells: Cells, kind: int) -> Floats:
    """Return the edges between free cells and those of a kind, joined along the grid.

    ``(n, 4)``, in cells from the lower left corner; free cells lie on the left.
    """
    runs: list[Floats] = []
    for turn in range(4):
        # After `turn` quarter turns: edges with free cells below.
        turned = np.rot90(cells, turn)
        edges = (turned[:-1] == FREE) & (turned[1:] == kind)
        padded = np.pad(edges, ((0, 0), (1, 1))).astype(np.int8)
        changes = np.diff(padded, axis=1)
        row, begin = np.nonzero(changes == 1)
        _, end = np.nonzero(changes == -1)
        y = row + 1.0
        ends = np.stack([np.stack([end, y], axis=1), np.stack([begin, y], axis=1)], axis=1).astype(np.float64)
        height, width = cells.shape
        for k in range(turn, 0, -1):
            # np.rot90 takes (x, y) to (y, width - x) where the array is that wide; here it is undone.
            wide = width if k % 2 else height
            ends = np.stack([wide - ends[..., 1], ends[..., 0]], axis=-1)
        runs.append(ends.reshape(-1, 4))
    return np.vstack(runs)


def _chords(pose: RigidTransform, angles: Floats, ranges: Floats, resolution: float) -> Floats:
    """Return how long each beam would run through the cell that it enters, metres."""
    d = np.stack([np.cos(angles + pose.theta), np.sin(angles + pose.theta)], axis=1)
    entry = (np.array([pose.x, pose.y]) + ranges[:, None] * d) / resolution
    cell = np.floor(entry + 1e-6 * d)
    with np.errstate(divide="ignore", invalid="ignore"):
        exits = np.where(d > 0.0, cell + 1.0 - entry, cell - entry) / d
    exits[~(exits >= 0.0)] = np.inf
    chords: Floats = np.minimum(exits.min(axis=1), math.sqrt(2.0)) * resolution
    return chords


def logged(name: str, stride: int) -> list[PosedScan]:
    """Read one in `stride` scans of a log, by way of a file as CARMEN writes it."""
    with np.load(DATA / "lidar" / f"{name}.npz") as data, tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{name}.log"
        good = np.flatnonzero(data["pose_good"])[::stride]
        path.write_text("".join(_lines(data["ranges"], data["poses_refined"], good)))
        scans = list(read_log(path))
    return [PosedScan(one.pose, one.laser) for one in scans if one.pose is not None]


def _lines(ranges: Floats, poses: Floats, chosen: NDArray[np.intp]) -> Iterator[str]:
    for k in chosen:
        numbers = " ".join(f"{r:.3f}" for r in ranges[k])
        place = " ".join(f"{v:.6f}" for v in poses[k])
        yield f"FLASER {len(ranges[k])} {numbers} {place} {place} {k}.0 robot {k}.0\n"


def opencv_faces(name: str) -> Segments | None:
    """Find faces by OpenCV's line detector in place of ours; None where OpenCV is not installed.

    The lines that it finds in the picture of the occupied cells, where they border on free space; directed, set back
    and cut to the least length as ours are.
    """
    try:
        import cv2
    except ImportError:
        return None
    grid, cells = load_cells(name)
    picture = np.where(cells == OCCUPIED, 0, 255).astype(np.uint8)
    lines = cv2.createLineSegmentDetector().detect(picture)[0]
    e = np.asarray(lines, dtype=np.float64).reshape(-1, 4) + 0.5
    span = e[:, 2:] - e[:, :2]
    lengths = np.hypot(span[:, 0], span[:, 1])
    e, span, lengths = (a[lengths >= 3.0] for a in (e, span, lengths))
    normals = np.stack([-span[:, 1], span[:, 0]], axis=1) / lengths[:, None]
    left, right = (_free_share(cells, e, sign * 1.5 * normals) for sign in (1.0, -1.0))
    backward = right > left
    e[backward] = e[backward][:, [2, 3, 0, 1]]
    normals[backward] *= -1.0
    beside = np.maximum(left, right) > 0.5
    e = e[beside] - 0.5 * np.tile(normals[beside], 2)
    return Segments.from_array(grid.origin.apply(e.reshape(-1, 2) * grid.resolution).reshape(-1, 4))


def _free_share(cells: Cells, e: Floats, aside: Floats) -> Floats:
    share = np.zeros(len(e))
    for along in np.linspace(0.1, 0.9, 9):
        x, y = np.floor(e[:, :2] + along * (e[:, 2:] - e[:, :2]) + aside).astype(int).T
        share += cells[np.clip(y, 0, cells.shape[0] - 1), np.clip(x, 0, cells.shape[1] - 1)] == FREE
    return share / 9.0
