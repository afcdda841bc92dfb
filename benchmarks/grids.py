"""Occupancy grids: Linefix next to a branch-and-bound matcher, scan by scan, on given, logged and drawn grids.

Given grids: scans are simulated in their cells, clean, with 30 % of the beams on clutter, and with a view of 180
degrees and 8 m. Logs: each grid is drawn from every second scan of a log, and others of its scans are searched in it.
Drawn grids: the plans of drawn buildings as cells of 5 cm.

``python -m benchmarks grids``, or with sizes ``python -m benchmarks.grids --scans 20``
"""

from __future__ import annotations

import argparse
import math
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

import linefix
from formats.grids.cells import FREE, OCCUPIED, UNKNOWN_GREY, classify
from formats.grids.map_server import read_grid
from formats.options import DEFAULT_OPTIONS
from formats.report import Notes
from registration import RigidTransform, Segments
from vectorization import LaserScan

from .grid_scans import GRIDS, PosedScan, grid_path, simulated
from .outcomes import offset, progress
from .peers.grid_matcher import GridMatcher
from .queries import DATA, data_found
from .table import Row, mean, print_rows, print_table, quantile
from .worlds import draw_case
from .worlds.measured.questions import laser

Floats = NDArray[np.float64]

RESOLUTION = 0.05  # m
NEAR = (0.3, 3.0)  # m and degrees that a right pose may be off
LOGS = ("intel", "freiburg-079", "seattle", "fhw")
LOG_RANGE = 20.0  # m; up to which a log is drawn
DRAWN = ("offices", "apartments", "hospital", "factory")
HALF_VIEW, HALF_RANGE = math.pi / 2, 8.0  # rad to either side, m
CLUTTER = 0.3  # of the beams
MARGIN = 2.0  # m; around a drawn grid
SEED = 20261126


@dataclass(frozen=True, slots=True)
class Answered:
    """The answers of both to one scan: whether they are right and usable, and their processor time, ms."""

    grid: str
    condition: str
    right: bool
    usable: bool
    milliseconds: float
    matcher_right: bool
    matcher_usable: bool
    matcher_milliseconds: float


@dataclass(frozen=True, slots=True)
class Scene:
    """A grid file, and scans in it by condition."""

    name: str
    path: Path
    scans: tuple[tuple[str, PosedScan], ...]


def grids(quick: int, scans: int = 40) -> list[Row]:
    """Print both in all grids; without the data folder in the drawn ones alone."""
    with tempfile.TemporaryDirectory() as folder:
        answers = [one for scene in _scenes(Path(folder), max(2, scans // quick)) for one in _race(scene)]
    print_table(
        f"Occupancy grids: Linefix next to branch and bound; {len(answers)} scans, ms of processor time",
        ("grid, condition", "scans", "right", "usable", "wrong", "ms", "right", "usable", "wrong", "ms"),
        [_cells(*group) for group in _groups(answers)],
    )
    rows = [
        Row("Grids: Linefix usable and wrong", f"{sum(a.usable and not a.right for a in answers)} of {len(answers)}"),
        Row("Grids: right first", f"{mean(a.right for a in answers):.3f}"),
        Row("Grids: usable", f"{mean(a.usable for a in answers):.3f}"),
    ]
    print_rows("Occupancy grids", rows)
    return rows


def _scenes(folder: Path, count: int) -> Iterator[Scene]:
    if data_found():
        for name in GRIDS:
            yield Scene(name, grid_path(name), tuple(_in_cells(name, count)))
        for name in LOGS:
            yield _of_log(name, folder, count)
    for world in DRAWN:
        yield from (_of_building(world, number, folder) for number in range(count))


def _in_cells(name: str, count: int) -> Iterator[tuple[str, PosedScan]]:
    rng = np.random.default_rng(SEED)
    for one in simulated(name, count, middle=True):
        yield "clean", one
        yield "clutter", PosedScan(one.pose, _cluttered(one.laser, rng))
        yield "half", PosedScan(one.pose, _half(one.laser))


def _cluttered(scan: LaserScan, rng: np.random.Generator) -> LaserScan:
    """Put round objects into a scan until they end the share of its beams."""
    ranges, angles = scan.ranges.copy(), scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
    for _ in range(400):
        if np.mean(ranges < scan.ranges - 0.05) >= CLUTTER:
            break
        k = int(rng.integers(len(ranges)))
        far = min(ranges[k], 6.0)
        if not far >= 1.2:
            continue
        away, radius = rng.uniform(0.7, far - 0.3), rng.uniform(0.2, 0.5)
        along = away * np.cos(angles - angles[k])
        inside = radius * radius - (away * away - along * along)
        hit = (inside > 0.0) & (along > 0.0)
        ranges[hit] = np.fmin(ranges[hit], np.maximum(0.35, along[hit] - np.sqrt(inside[hit])))
    return replace(scan, ranges=ranges)


def _half(scan: LaserScan) -> LaserScan:
    """Leave the beams to the front, up to a shorter range."""
    angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
    front = np.flatnonzero(np.abs(angles) <= HALF_VIEW)
    ranges = np.where(scan.ranges[front] > HALF_RANGE, math.inf, scan.ranges[front])
    return LaserScan(float(angles[front[0]]), scan.angle_increment, ranges, scan.range_min, HALF_RANGE)


def _of_log(name: str, folder: Path, count: int) -> Scene:
    """Draw a grid from every second scan of a log; the scans to be found are some of the others."""
    with np.load(DATA / "lidar" / f"{name}.npz") as data:
        poses, angles, ranges = data["poses_refined"], data["angles"], data["ranges"].astype(np.float64)
        reach, good = float(data["range_max_valid"]), np.flatnonzero(data["pose_good"])
    path = grid_of_log(name, good[good % 2 == 0], folder / f"{name}.yaml")
    chosen = good[good % 2 == 1]
    chosen = chosen[np.linspace(0, len(chosen) - 1, count).astype(int)]
    step = float(angles[1] - angles[0])
    scans = [
        PosedScan(
            RigidTransform(*poses[k].tolist()), LaserScan(float(angles[0]), step, ranges[k], 0.1, min(reach, 30.0))
        )
        for k in chosen
    ]
    return Scene(f"{name} (log)", path, tuple(("log", one) for one in scans))


def grid_of_log(name: str, chosen: NDArray[np.intp], path: Path) -> Path:
    """Draw a grid from some scans of a log at their refined poses, and write it as map_server has it."""
    with np.load(DATA / "lidar" / f"{name}.npz") as data:
        poses, angles, ranges = data["poses_refined"], data["angles"], data["ranges"].astype(np.float64)
        limit = min(float(data["range_max_valid"]), LOG_RANGE)
    low = poses[chosen, :2].min(axis=0) - limit - MARGIN
    shape = tuple(np.ceil((poses[chosen, :2].max(axis=0) + limit + MARGIN - low) / RESOLUTION).astype(int)[::-1])
    hits, passed = np.zeros(shape, np.int32), np.zeros(shape, np.int32)
    for k in chosen:
        seen = (ranges[k] > 0.1) & (ranges[k] < limit)
        heading = angles[seen] + poses[k, 2]
        ends, to = ranges[k][seen], np.stack([np.sin(heading), np.cos(heading)])
        _count(hits, poses[k, :2] - low, to, ends)
        for r in np.arange(0.1, limit, RESOLUTION):
            through = ends > r + 2.0 * RESOLUTION
            _count(passed, poses[k, :2] - low, to[:, through], np.full(int(through.sum()), r))
    occupied = (hits > 1) & (hits > 0.2 * passed)
    return _write(path, occupied, passed > 0, (float(low[0]), float(low[1])))


def _count(
    counts: NDArray[np.int32], begin: NDArray[np.float64], to: NDArray[np.float64], r: NDArray[np.float64]
) -> None:
    """Add one to the cells at distances `r` (n,) along directions `to` (2, n): row and column."""
    row, column = ((begin[::-1, None] + r * to) / RESOLUTION).astype(int)
    np.add.at(counts, (row, column), 1)


def _of_building(world: str, number: int, folder: Path) -> Scene:
    """Draw the plan of a building as a grid, free where the place of the scan can be reached."""
    case = draw_case(world, "clean", number)
    assert case.truth is not None
    low = case.map.endpoints.reshape(-1, 2).min(axis=0) - MARGIN
    high = case.map.endpoints.reshape(-1, 2).max(axis=0) + MARGIN
    occupied = np.zeros(tuple(np.ceil((high - low) / RESOLUTION).astype(int)[::-1]), bool)
    column, row = np.floor((_points_on(case.map) - low) / RESOLUTION).astype(int).T
    occupied[row, column] = True
    rooms, _ = ndimage.label(~occupied)
    here = np.floor((np.array([case.truth.x, case.truth.y]) - low) / RESOLUTION).astype(int)
    path = _write(
        folder / f"{world}-{number}.yaml", occupied, rooms == rooms[here[1], here[0]], (float(low[0]), float(low[1]))
    )
    return Scene(world, path, (("drawn", PosedScan(case.truth, laser(case.scanner, case.ranges))),))


def _points_on(segments: Segments) -> Floats:
    """Return points on segments, a third of a cell apart, (n, 2)."""
    pieces = []
    for x1, y1, x2, y2 in segments.endpoints:
        t = np.linspace(0.0, 1.0, 2 + int(3.0 * math.hypot(x2 - x1, y2 - y1) / RESOLUTION))[:, None]
        pieces.append((1.0 - t) * [x1, y1] + t * [x2, y2])
    return np.vstack(pieces)


def _write(path: Path, occupied: NDArray[np.bool_], free: NDArray[np.bool_], corner: tuple[float, float]) -> Path:
    """Write a grid as map_server has it; row 0 of the arrays is the lowest."""
    picture = np.full(occupied.shape, UNKNOWN_GREY, np.uint8)
    picture[free], picture[occupied] = 254, 0
    header = f"P5\n{len(picture[0])} {len(picture)}\n255\n".encode()
    path.with_suffix(".pgm").write_bytes(header + picture[::-1].tobytes())
    path.write_text(
        f"image: {path.stem}.pgm\nresolution: {RESOLUTION}\norigin: [{corner[0]}, {corner[1]}, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return path


def _race(scene: Scene) -> Iterator[Answered]:
    grid, _ = read_grid(scene.path, DEFAULT_OPTIONS, Notes())
    cells = classify(grid, Notes())
    matcher = GridMatcher(cells == OCCUPIED, cells == FREE, grid.resolution, grid.origin)
    index = linefix.index_map(linefix.read_map(scene.path))
    for k, (condition, one) in enumerate(scene.scans):
        angles = one.laser.angle_min + one.laser.angle_increment * np.arange(len(one.laser.ranges))
        ranges = np.asarray(one.laser.ranges, dtype=np.float64)
        seen = np.isfinite(ranges) & (ranges <= one.laser.range_max)
        if k == 0:  # what is built at the first search of a map does not count
            linefix.locate(index, one.laser)
        start = time.thread_time()
        answer = linefix.locate(index, one.laser)
        between = time.thread_time()
        match = matcher.match(np.asarray(angles[seen], np.float64), ranges[seen])
        end = time.thread_time()
        yield Answered(
            scene.name, condition, _right(answer.pose, one.pose), answer.usable, 1e3 * (between - start),
            _right(match.pose, one.pose), match.usable, 1e3 * (end - between),
        )  # fmt: skip
        progress(scene.name, k + 1, len(scene.scans))


def _right(pose: RigidTransform | None, truth: RigidTransform) -> bool:
    if pose is None:
        return False
    distance, angle = offset(pose, truth)
    return distance < NEAR[0] and angle < NEAR[1]


def _groups(answers: Iterable[Answered]) -> Iterator[tuple[str, list[Answered]]]:
    """Yield the answers by grid and condition, then by condition."""
    listed = list(answers)
    by_grid: dict[str, list[Answered]] = {}
    for one in listed:
        by_grid.setdefault(f"{one.grid}, {one.condition}", []).append(one)
    yield from by_grid.items()
    for condition in dict.fromkeys(one.condition for one in listed):
        yield f"all, {condition}", [one for one in listed if one.condition == condition]


def _cells(name: str, answers: list[Answered]) -> tuple[str, ...]:
    times = [a.milliseconds for a in answers], [a.matcher_milliseconds for a in answers]
    spread = [f"{quantile(some, 0.5):.0f} / {quantile(some, 0.95):.0f}" for some in times]
    return (
        name, str(len(answers)),
        f"{mean(a.right for a in answers):.3f}", f"{mean(a.usable for a in answers):.3f}",
        str(sum(a.usable and not a.right for a in answers)), spread[0],
        f"{mean(a.matcher_right for a in answers):.3f}", f"{mean(a.matcher_usable for a in answers):.3f}",
        str(sum(a.matcher_usable and not a.matcher_right for a in answers)), spread[1],
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scans", type=int, default=40, help="of each grid and condition")
    grids(1, parser.parse_args().scans)


if __name__ == "__main__":
    main()
