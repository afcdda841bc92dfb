"""Grids in recordings: which topic is the map, and where the grid lies."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from formats import ImportedMap, ImportOptions, IncompleteFileError, MalformedFileError, read_map

from .bags import BEGUN, GRID, Recording, grid_bytes
from .reading import notes


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


def read(recording: Recording, grids: dict[str, Any], times: int = 1) -> ImportedMap:
    for name, cells in grids.items():
        for k in range(1 if cells is MAP else times):
            recording.put(name, BEGUN + k, grid_bytes(cells), GRID)
    return read_map(recording.done())


@pytest.mark.parametrize("first", ["/map", "/robot1/map", "/slam/map", "/cartographer_grid"])
@pytest.mark.parametrize("other", ["/global_costmap/costmap", "/move_base/local_costmap/costmap", "/navigation/grid"])
def test_the_map_is_taken_and_not_costmaps(recording: Recording, first: str, other: str) -> None:
    imported = read(recording, {other: COSTS, first: MAP}, times=5)
    assert len(imported.map.segments) == 4
    message = notes(imported)["topic"].message
    assert message.startswith(f"the grid of {first} (60 x 50 cells of 0.1 m) is the map; not {other} (60 x 50")


def test_a_topic_called_map_goes_before_others(recording: Recording) -> None:
    imported = read(recording, {"/a": MAP, "/map": MAP, "/robot/map": MAP})
    assert "the grid of /map " in notes(imported)["topic"].message


@pytest.mark.parametrize(
    "grids", [{"/a": MAP, "/b": MAP}, {"/r1/map": MAP, "/r2/map": MAP}, {"/x/costmap": COSTS, "/y/costmap": COSTS}]
)
def test_where_it_is_not_clear_the_topics_are_listed(recording: Recording, grids: dict[str, Any]) -> None:
    first, second = grids
    with pytest.raises(IncompleteFileError, match=rf"{first} \(60 x 50 .*\), {second} \(60 x 50 .*\); .*--topic"):
        read(recording, grids)
    if "costmap" not in first:
        chosen = read_map(recording.path, ImportOptions(topic=second.lstrip("/")))
        assert len(chosen.map.segments) == 4


def test_a_grid_without_cells_is_passed_over(recording: Recording) -> None:
    recording.put("/map", BEGUN, grid_bytes(MAP), GRID)
    recording.put("/map", BEGUN + 1, grid_bytes(np.zeros((0, 0))), GRID)
    assert len(read_map(recording.done()).map.segments) == 4


def test_a_bag_without_a_grid_names_its_topics(recording: Recording) -> None:
    recording.channel("/map", GRID)
    recording.scans(2)
    with pytest.raises(
        IncompleteFileError, match=r"no messages of OccupancyGrid; .*/map .*, 0\), /scan .*LaserScan, 2"
    ):
        read_map(recording.done())


@pytest.mark.parametrize(
    ("orientation", "noted", "right"),
    [
        ((0, 0, 0, 0), True, 10.05),  # never set
        ((0, 0, 0, 1), False, 10.05),
        ((0, 0, 0, 2), False, 10.05),
        ((0, 0, 0, -1), False, 10.05),
        ((0, 0, math.sin(math.pi / 4), math.cos(math.pi / 4)), False, 5.0 - 0.95),  # a quarter turn
    ],
)
def test_the_orientation_of_a_grid(
    recording: Recording, orientation: tuple[float, ...], noted: bool, right: float
) -> None:
    recording.put("/map", BEGUN, grid_bytes(MAP, (5.0, 0.0, 0.0), tuple(map(float, orientation))), GRID)
    imported = read_map(recording.done())
    assert imported.map.segments.midpoints[:, 0].max() == pytest.approx(right, abs=0.01)
    assert ("orientation" in notes(imported)) == noted


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
    recording: Recording, position: tuple[float, float, float], orientation: tuple[float, ...], message: str
) -> None:
    recording.put("/map", BEGUN, grid_bytes(MAP, position, orientation), GRID)
    with pytest.raises(MalformedFileError, match=message):
        read_map(recording.done())


def test_a_costmap_alone_is_named(recording: Recording) -> None:
    with pytest.raises(MalformedFileError, match=r"no wall found: .*; /local_costmap/costmap is a costmap"):
        read(recording, {"/local_costmap/costmap": COSTS})


def test_a_costmap_without_a_rim_is_a_map_with_a_note(recording: Recording) -> None:
    imported = read(recording, {"/costmap": np.where((COSTS > 0) & (COSTS < 100), 0, COSTS)})
    assert "costmap" in notes(imported)
