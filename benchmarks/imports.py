"""Maps from files of other tools, and what scans then give: ``python -m benchmarks imports``.

No parameter is given to any import. The scans simulated in a grid come from its cells, not from the segments. A log and
the grid of the same building come from two runs of different software: the one transform between the two that most
answers agree in is the truth, and what is right may be off by what the two differ.
"""

from __future__ import annotations

import math
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from association import AssociationResult, MapIndex, associate
from formats import ImportOptions, LineMap, read_map, write_map
from linefix import scan_of
from registration import IDENTITY, RigidTransform, Segments

from .centre_lines import drawn_plans
from .collection import LEVELS, Collection
from .grid_scans import GRIDS, LOG_OF, PosedScan, grid_path, logged, opencv_faces, simulated
from .outcomes import OPTIONS, offset
from .queries import data_found, floor_plans
from .table import Row, at_least, mean, print_rows, print_table, quantile

USABLE, RIGHT = 0.80, 0.995
SCANS = 100  # of each grid
LOG_STRIDES = {"intel": 4, "freiburg-079": 8}
NEAR = (0.3, 3.0)  # m and degrees that an answer to a simulated scan may be off,
NEAR_IN_LOG = (0.5, 5.0)  # and one to a scan of a log
AGREED = 0.5  # m
CENTRES = 10  # of each plan that is drawn by centre lines
DRAWN = ("dxf", "svg", "geojson")
SAME = 1e-6  # m and rad; poses of the same verdict


@dataclass(frozen=True, slots=True)
class Found:
    """The result of one scan: how far off, metres and degrees; inf where there is no pose."""

    usable: bool
    distance: float
    angle: float
    limits: tuple[float, float]

    @property
    def right(self) -> bool:
        """Return whether the answer is near enough."""
        return self.distance < self.limits[0] and self.angle < self.limits[1]


def imports(quick: int) -> list[Row]:
    """Print what scans give in imported maps; nothing where the data folder is absent."""
    if not data_found() or not all(grid_path(name).is_file() for name in GRIDS):
        print("\nImports: skipped, for the grids are not there.")
        return []
    rows = _grids(quick) + _logs(quick) + _drawings(quick) + _centre_lines(quick)
    print_rows("Imported maps", rows)
    return rows


def _answers(line_map: LineMap, scans: list[PosedScan]) -> list[AssociationResult]:
    index = MapIndex.build(line_map.segments, line_map.sigma, oriented=line_map.oriented)
    return [associate(index, scan_of(one.laser), None, OPTIONS) for one in scans]


def _found(answer: AssociationResult, truth: RigidTransform, limits: tuple[float, float]) -> Found:
    away = (math.inf, math.inf) if answer.pose is None else offset(answer.pose, truth)
    return Found(answer.usable, *away, limits)


def _located(line_map: LineMap, scans: list[PosedScan]) -> list[Found]:
    pairs = zip(_answers(line_map, scans), scans, strict=True)
    return [_found(answer, one.pose, NEAR) for answer, one in pairs]


def _cells(found: list[Found]) -> list[str]:
    usable = [f for f in found if f.usable]
    right = [f for f in found if f.right]
    return [
        f"{mean(f.right for f in found):.3f}",
        f"{mean(f.usable for f in found):.3f}",
        str(sum(not f.right for f in usable)),
        f"{100.0 * quantile([f.distance for f in right], 0.5):.1f}",
        f"{quantile([f.angle for f in right], 0.5):.2f}",
    ]


HEAD = ("right", "usable", "of these wrong", "median cm", "degrees")


def _grids(quick: int) -> list[Row]:
    rows, cells, together = [], [], []
    for name in GRIDS:
        began = time.perf_counter()
        line_map = read_map(grid_path(name)).map
        seconds = time.perf_counter() - began
        scans = simulated(name, max(5, SCANS // quick), middle=True)
        found = _located(line_map, scans)
        together += found
        count = str(len(line_map.segments))
        cells.append((name, "linefix", count, f"{seconds:.2f}", *_cells(found)))
        at_border = _located(line_map, simulated(name, len(scans), middle=False))
        cells.append((name, "linefix, beams end at the cells' border", count, "", *_cells(at_border)))
        other = opencv_faces(name)
        if other is not None:
            count = str(len(other))
            cells.append(
                (name, "OpenCV's detector", count, "", *_cells(_located(LineMap(other, line_map.sigma), scans)))
            )
        rows.append(at_least(f"{name}: usable of simulated scans", mean(f.usable for f in found), USABLE))
    print_table("Grids, scans simulated in their cells", ("grid", "faces by", "segments", "s", *HEAD), cells)
    right = mean(f.right for f in together if f.usable)
    return [*rows, at_least("all grids: right of the usable", right, RIGHT, form=".4f")]


def _logs(quick: int) -> list[Row]:
    rows, cells = [], []
    for name, log in LOG_OF.items():
        scans = logged(log, LOG_STRIDES[log] * quick)
        line_map = read_map(grid_path(name)).map
        other = opencv_faces(name)
        maps = {"linefix": line_map} | ({"OpenCV's detector": LineMap(other, line_map.sigma)} if other else {})
        for by, one in maps.items():
            found = _found_in_log(_answers(one, scans), scans)
            cells.append((name, by, str(len(found)), *_cells(found)))
            if by == "linefix":
                usable = [f for f in found if f.usable]
                rows.append(at_least(f"{name}: usable of its log's scans", len(usable) / len(found), USABLE))
                rows.append(at_least(f"{name}: right of these", mean(f.right for f in usable), RIGHT, form=".4f"))
    print_table("Grids, scans of the log", ("grid", "faces by", "scans", *HEAD), cells)
    return rows


def _found_in_log(answers: list[AssociationResult], scans: list[PosedScan]) -> list[Found]:
    """Compare with the log's poses by the grid_from_log that most usable answers agree in."""
    pairs = [(a.pose, s.pose) for a, s in zip(answers, scans, strict=True) if a.usable and a.pose is not None]
    logged_at = np.array([(p.x, p.y) for _, p in pairs])
    found_at = np.array([(p.x, p.y) for p, _ in pairs])
    best, agreed = IDENTITY, -1
    for pose, truth in pairs:
        grid_from_log = pose.compose(truth.inverse())
        away = np.hypot(*(grid_from_log.apply(logged_at) - found_at).T)
        if int((away < AGREED).sum()) > agreed:
            best, agreed = grid_from_log, int((away < AGREED).sum())
    return [_found(answer, best.compose(one.pose), NEAR_IN_LOG) for answer, one in zip(answers, scans, strict=True)]


def _drawings(quick: int) -> list[Row]:
    """Compare verdicts in plans with those in the same plans written and read again."""
    collection = floor_plans(quick)
    keys = sorted({q.map for q in collection.queries if q.family == "public_buildings"})
    plans = {key: collection.maps[key] for key in keys}
    drawn = Collection("plans", plans, tuple(q for q in collection.queries if q.map in plans), 0.1, 1.0)
    original = _verdicts(drawn, plans)
    rows, cells = [], [("as they are", *_shares(drawn, original))]
    with tempfile.TemporaryDirectory() as folder:
        for suffix in DRAWN:
            again = {key: _written_and_read(plans[key], Path(folder) / f"plan.{suffix}") for key in keys}
            answers = _verdicts(drawn, again)
            same = mean(_same(a, b) for a, b in zip(original, answers, strict=True))
            rows.append(at_least(f"plans as {suffix}: same verdicts", same, 1.0, form=".4f"))
            cells.append((suffix, *_shares(drawn, answers)))
        inside = {key: _from_inside(key, drawn, Path(folder) / "plan.dxf") for key in keys}
        cells.append(("dxf without directions, from free places", *_shares(drawn, _verdicts(drawn, inside))))
    head = ("plans", "right", "usable", "of these wrong")
    print_table(f"Drawings of {len(keys)} plans, {len(drawn.queries)} scans, levels {', '.join(LEVELS)}", head, cells)
    return rows


def _centre_lines(quick: int) -> list[Row]:
    """Compare what may be said of plans that are drawn by the centre lines of their walls."""
    found: dict[str, list[Found]] = {}
    for plan in drawn_plans(max(3, CENTRES // quick)):
        for said, line_map in plan.imports().items():
            found.setdefault(said, []).extend(_located(line_map, list(plan.scans)))
    cells = [(said, str(len(some)), *_cells(some)) for said, some in found.items()]
    print_table("Plans drawn by centre lines, as DXF", ("said of it", "scans", *HEAD), cells)
    unsaid = found["nothing is said"]
    return [
        at_least("centre lines, nothing said: usable", mean(f.usable for f in unsaid), USABLE),
        at_least("centre lines, nothing said: right of these", mean(f.right for f in unsaid if f.usable), RIGHT),
    ]


def _written_and_read(segments: Segments, path: Path) -> Segments:
    write_map(LineMap(segments), path)
    return read_map(path).map.segments


def _from_inside(key: tuple[str, str], drawn: Collection, path: Path) -> Segments:
    """Write a plan without directions, turned at random, and find them from where its scans were taken."""
    segments = drawn.maps[key]
    backward = np.random.default_rng(1).random(len(segments)) < 0.5
    corners = segments.endpoints.copy()
    corners[backward] = corners[backward][:, [2, 3, 0, 1]]
    write_map(LineMap(Segments.from_array(corners), oriented=False), path)
    places = tuple((q.pose.x, q.pose.y) for q in drawn.queries if q.map == key)
    return read_map(path, ImportOptions(inside=places)).map.segments


def _verdicts(drawn: Collection, maps: dict[tuple[str, str], Segments]) -> list[AssociationResult]:
    indexes = {key: MapIndex.build(segments) for key, segments in maps.items()}
    return [associate(indexes[q.map], q.scan, None, OPTIONS) for q in drawn.queries]


def _shares(drawn: Collection, answers: list[AssociationResult]) -> tuple[str, str, str]:
    found = [_found(a, q.pose, (drawn.distance, drawn.angle)) for a, q in zip(answers, drawn.queries, strict=True)]
    right, usable, wrong = _cells(found)[:3]
    return right, usable, wrong


def _same(a: AssociationResult, b: AssociationResult) -> bool:
    if a.status != b.status or a.usable != b.usable or (a.pose is None) != (b.pose is None):
        return False
    if a.pose is None or b.pose is None:
        return True
    away, angle = offset(a.pose, b.pose)
    return away < SAME and math.radians(angle) < SAME
