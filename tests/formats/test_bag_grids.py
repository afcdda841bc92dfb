"""Grids in recordings: which topic is the map, and where the grid lies."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from formats import ImportedMap, ImportOptions, IncompleteFileError, MalformedFileError, read_map

from .bags import BEGUN, GRID, Recording, grid_bytes


def room() -> Any:
    cells = np.full((50, 60), -1)
    cells[9:41, 9:51] = 100
    cells[10:40, 10:50] = 0
    return cells


def inflated(cells: Any) -> Any:
    """Return a costmap: around each obstacle a rim of 99, then less."""
    lethal, cost = cells == 100, cells.copy()
    for value, reach in ((40, 3), (99, 2), (99, 1)):
        grown = lethal.copy()
        for _ in range(reach):
            padded = np.pad(grown, 1)
            grown = padded[1:-1, 1:-1] | padded[:-2, 1:-1] | padded[2:, 1:-1] | padded[1:-1, :-2] | padded[1:-1, 2:]
        cost[grown & (cells == 0)] = value
    return cost


MAP, COSTS = room(), inflated(room())


def read(tmp_path: Path, grids: dict[str, Any], topic: str | None = None, times: int = 1) -> ImportedMap:
    recording = Recording(tmp_path / "a.mcap")
    for name, cells in grids.items():
        for k in range(1 if cells is MAP else times):
            recording.put(name, BEGUN + k, grid_bytes(cells), GRID)
    return read_map(recording.done(), ImportOptions(topic=topic))


@pytest.mark.parametrize("first", ["/map", "/robot1/map", "/slam/map", "/cartographer_grid"])
@pytest.mark.parametrize("other", ["/global_costmap/costmap", "/move_base/local_costmap/costmap", "/navigation/grid"])
def test_the_map_is_taken_and_not_costmaps(tmp_path: Path, first: str, other: str) -> None:
    imported = read(tmp_path, {other: COSTS, first: MAP}, times=5)
    assert len(imported.map.segments) == 4
    (note,) = [note for note in imported.report.assumed if note.code == "topic"]
    assert note.message.startswith(f"the grid of {first} (60 x 50 cells of 0.1 m) is the map; not {other} (60 x 50")


def test_a_topic_called_map_goes_before_others(tmp_path: Path) -> None:
    imported = read(tmp_path, {"/a": MAP, "/map": MAP, "/robot/map": MAP})
    assert "the grid of /map " in next(note.message for note in imported.report.assumed if note.code == "topic")


@pytest.mark.parametrize(
    "grids", [{"/a": MAP, "/b": MAP}, {"/r1/map": MAP, "/r2/map": MAP}, {"/x/costmap": COSTS, "/y/costmap": COSTS}]
)
def test_where_it_is_not_clear_the_topics_are_listed(tmp_path: Path, grids: dict[str, Any]) -> None:
    first, second = grids
    with pytest.raises(IncompleteFileError, match=rf"{first} \(60 x 50 .*\), {second} \(60 x 50 .*\); .*--topic"):
        read(tmp_path, grids)
    if "costmap" not in first:
        assert len(read(tmp_path, grids, second.lstrip("/")).map.segments) == 4


def test_a_grid_without_cells_is_passed_over(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "a.mcap")
    recording.put("/map", BEGUN, grid_bytes(MAP), GRID)
    recording.put("/map", BEGUN + 1, grid_bytes(np.zeros((0, 0))), GRID)
    assert len(read_map(recording.done()).map.segments) == 4


def test_a_bag_without_a_grid_names_its_topics(tmp_path: Path) -> None:
    recording = Recording(tmp_path / "a.mcap")
    recording.channel("/map", GRID)
    recording.scans(2)
    with pytest.raises(
        IncompleteFileError, match=r"no messages of OccupancyGrid; .*/map .*, 0\), /scan .*LaserScan, 2"
    ):
        read_map(recording.done())


def placed(tmp_path: Path, position: tuple[float, float, float], orientation: tuple[float, ...]) -> ImportedMap:
    recording = Recording(tmp_path / "a.mcap")
    recording.put("/map", BEGUN, grid_bytes(MAP, position, orientation), GRID)
    return read_map(recording.done())


@pytest.mark.parametrize(
    ("orientation", "noted"),
    [((0, 0, 0, 0), True), ((0, 0, 0, 1), False), ((0, 0, 0, 2), False), ((0, 0, 0, -1), False)],
)
def test_an_orientation_that_was_never_set_is_none(tmp_path: Path, orientation: tuple[float, ...], noted: bool) -> None:
    imported = placed(tmp_path, (5.0, 0.0, 0.0), tuple(map(float, orientation)))
    assert imported.map.segments.midpoints[:, 0].max() == pytest.approx(5.0 + 5.05, abs=0.01)
    assert ("orientation" in {note.code for note in imported.report.assumed}) == noted


def test_a_turned_grid_is_turned(tmp_path: Path) -> None:
    half = math.pi / 4
    imported = placed(tmp_path, (0.0, 0.0, 0.0), (0.0, 0.0, math.sin(half), math.cos(half)))
    assert imported.map.segments.midpoints[:, 0].max() < 0.0


@pytest.mark.parametrize(
    ("position", "orientation", "message"),
    [
        ((0.0, 0.0, 0.0), (0.0, 0.0, math.nan, 1.0), "info.origin is not finite: .* orientation .*nan"),
        ((math.nan, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), "info.origin is not finite: position .*nan"),
        ((0.0, math.inf, 0.0), (0.0, 0.0, 0.0, 0.0), "info.origin is not finite"),
        ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0), "is not horizontal"),
        ((0.0, 0.0, 0.0), (0.0, 0.5, 0.0, 0.9), "is not horizontal"),
    ],
)
def test_an_origin_that_is_none_is_refused(
    tmp_path: Path, position: tuple[float, float, float], orientation: tuple[float, ...], message: str
) -> None:
    with pytest.raises(MalformedFileError, match=message):
        placed(tmp_path, position, orientation)


def test_a_costmap_alone_is_named(tmp_path: Path) -> None:
    with pytest.raises(MalformedFileError, match=r"no wall found: .*; /local_costmap/costmap is a costmap"):
        read(tmp_path, {"/local_costmap/costmap": COSTS})
    thin = np.where((COSTS > 0) & (COSTS < 100), 0, COSTS)
    imported = read(tmp_path, {"/costmap": thin})
    assert "costmap" in {note.code for note in imported.report.assumed}
