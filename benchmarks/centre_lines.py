"""Plans drawn by the centre lines of their walls, read from DXF, and what scans then give."""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from association import Deadline, MapIndex
from formats import ImportOptions, LineMap, read_map, write_map
from linefix import scan_of
from map_quality import find_thickness
from registration import RigidTransform, Segments
from simulation import Scanner, scan
from vectorization import LaserScan

from .grid_scans import PosedScan

Floats = NDArray[np.float64]

# m; partitions and outer walls of the plans, which take turns.
THICKNESSES = ((0.1, 0.3), (0.15, 0.15), (0.2, 0.36), (0.3, 0.3), (0.1, 0.1), (0.2, 0.2))
LEAST_ROOM, DOOR, CLEARANCE = 3.0, 0.9, 0.35  # m
SCANNER = Scanner(beams=720, angle_increment=math.tau / 720, range_max=12.0)
BOXES = 12  # that stand about and are on no plan
SAMPLES = 6  # scans that a thickness is found from; none of them is counted
SEED = 15


@dataclass(frozen=True, slots=True)
class DrawnPlan:
    """A plan: its centre lines, ``(n, 4)`` and ``(n,)`` metres thick, and scans in the building."""

    lines: Floats
    thickness: Floats
    samples: tuple[PosedScan, ...]
    scans: tuple[PosedScan, ...]

    def imports(self) -> dict[str, LineMap]:
        """Return the maps from its drawing, by the options of the import."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "plan.dxf"
            write_map(LineMap(Segments.from_array(self.lines), oriented=False), path)
            unsaid = read_map(path).map
            found = ImportOptions(thickness=float(unsaid.meta["thickness"]) + self._thicker(unsaid))
            return {
                "lines as drawn, without direction": read_map(path, ImportOptions(drawn="faces")).map,
                "nothing is said": unsaid,
                f"thickness from {SAMPLES} other scans": read_map(path, found).map,
                "thickness of the partitions given": read_map(path, ImportOptions(thickness=self.thickness.min())).map,
            }

    def _thicker(self, line_map: LineMap) -> float:
        scans = [scan_of(one.laser) for one in self.samples]
        return find_thickness(MapIndex.build(line_map.segments), scans, Deadline(), oriented=True) or 0.0


def drawn_plans(scans: int) -> list[DrawnPlan]:
    """Draw a plan for each thickness, with so many scans each."""
    rng = np.random.default_rng(SEED)
    return [_plan(rng, inner, outer, scans) for inner, outer in THICKNESSES]


def _plan(rng: np.random.Generator, inner: float, outer: float, count: int) -> DrawnPlan:
    width, depth = rng.uniform(20.0, 30.0), rng.uniform(13.0, 20.0)
    partitions = _parted(rng, (0.0, 0.0, width, depth))
    outline = [(0.0, 0.0, width, 0.0), (width, 0.0, width, depth), (width, depth, 0.0, depth), (0.0, depth, 0.0, 0.0)]
    lines = np.array([*partitions, *outline])
    thickness = np.array([inner] * len(partitions) + [outer] * len(outline))
    walls = _solid(lines, thickness)
    boxes = [_box(rng, width, depth) for _ in range(BOXES)]
    world = Segments.from_array(np.vstack([walls, *boxes]))
    taken = tuple(_taken(world, rng, (width, depth)) for _ in range(SAMPLES + count))
    return DrawnPlan(lines, thickness, taken[:SAMPLES], taken[SAMPLES:])


def _parted(rng: np.random.Generator, room: tuple[float, float, float, float]) -> list[tuple[float, ...]]:
    """Part a room by a wall with a door, and what it is parted into again, down to the least."""
    x0, y0, x1, y1 = room
    across = x1 - x0 > y1 - y0
    long = x1 - x0 if across else y1 - y0
    if long < 2.0 * LEAST_ROOM:
        return []
    at = rng.uniform(LEAST_ROOM, long - LEAST_ROOM)
    if across:
        low, high, x = y0, y1, x0 + at
        door = rng.uniform(low + 0.4, high - 0.4 - DOOR)
        walls = [(x, low, x, door), (x, door + DOOR, x, high)]
        return [*walls, *_parted(rng, (x0, y0, x, y1)), *_parted(rng, (x, y0, x1, y1))]
    low, high, y = x0, x1, y0 + at
    door = rng.uniform(low + 0.4, high - 0.4 - DOOR)
    walls = [(low, y, door, y), (door + DOOR, y, high, y)]
    return [*walls, *_parted(rng, (x0, y0, x1, y)), *_parted(rng, (x0, y, x1, y1))]


def _solid(lines: Floats, thickness: Floats) -> Floats:
    """Return the four sides of every wall."""
    one = Segments.from_array(lines)
    left, right = (each.moved_left(0.5 * thickness).endpoints for each in (one, one.reversed()))
    ends = [np.hstack([right[:, 2:], left[:, :2]]), np.hstack([left[:, 2:], right[:, :2]])]
    return np.vstack([left, right, *ends])


def _box(rng: np.random.Generator, width: float, depth: float) -> Floats:
    at = RigidTransform(rng.uniform(1.0, width - 1.0), rng.uniform(1.0, depth - 1.0), rng.uniform(-math.pi, math.pi))
    w, h = rng.uniform(0.15, 0.6, 2)
    corners = at.apply(np.array([[-w, -h], [-w, h], [w, h], [w, -h]]))
    return np.hstack([corners, np.roll(corners, -1, axis=0)])


def _taken(world: Segments, rng: np.random.Generator, size: tuple[float, float]) -> PosedScan:
    while True:
        x, y = rng.uniform(0.5, size[0] - 0.5), rng.uniform(0.5, size[1] - 0.5)
        pose = RigidTransform(x, y, rng.uniform(-math.pi, math.pi))
        ranges = scan(world, pose, SCANNER, rng).ranges
        if np.nanmin(ranges) > CLEARANCE:
            break
    laser = LaserScan(SCANNER.angle_min, SCANNER.angle_increment, ranges, 0.0, SCANNER.range_max)
    return PosedScan(pose, laser)
