"""Messages of recordings: grids, fields of scans that were never set or contradict each other, stamps of 0."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import linefix
from formats import ImportedMap, ImportOptions, IncompleteFileError, Log, MalformedFileError, read_log, read_map
from vectorization import LaserScan

from .bags import BEGUN, GRID, SECOND, USUAL, Laser, Recording, grid_bytes, room_cells, scan_bytes
from .reading import counts, notes


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


MAP, COSTS = room_cells(), inflated(room_cells())


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
def test_orientations_of_grids(recording: Recording, orientation: tuple[float, ...], noted: bool, right: float) -> None:
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


FLT_MAX = float(np.finfo(np.float32).max)
LEAST = 0.0, math.nan, -1.0, math.inf, -math.inf
MIXED = (2.0,) * 89 + (math.inf, 0.0)  # two beams without a return, as one driver and another write them
CLIPPED = {"ranges": (2.0,) * 89 + (10.0, 0.0), "range_max": 10.0}  # and a third


def read_scans(tmp_path: Path, *lasers: Laser) -> tuple[list[LaserScan], Log]:
    recording = Recording(tmp_path / "a.mcap")
    for k, laser in enumerate(lasers):
        recording.put("/scan", BEGUN + k, scan_bytes(BEGUN + k * SECOND, laser))
    log = read_log(recording.done())
    return [scan.laser for scan in log], log


def assumed(log: Log) -> dict[str, int]:
    """Return the counts of what was assumed of the scans; these recordings have no odometry."""
    return {code: count for code, count in counts(log, "assumed").items() if code != "no_odometry"}


@pytest.mark.parametrize("most", [0.0, -1.0, math.nan, math.inf, FLT_MAX, 1e6, 0.05])
def test_a_greatest_range_that_says_nothing_leaves_readings_and_no_free_space(tmp_path: Path, most: float) -> None:
    lasers, log = read_scans(tmp_path, *[USUAL.but(ranges=MIXED, range_max=most)] * 3)
    for laser in lasers:
        np.testing.assert_array_equal(laser.cleaned, (2.0,) * 89 + (math.nan,) * 2)
    assert assumed(log) == {"range_max": 3}
    assert f"range_max is {np.float32(most):g} m" in notes(log)["range_max"].message


@pytest.mark.parametrize("fields", [{}, CLIPPED, {"range_max": 1000.0}, *({"range_min": least} for least in LEAST)])
def test_a_least_range_that_is_none_is_taken_as_0(tmp_path: Path, fields: dict[str, Any]) -> None:
    (laser,), log = read_scans(tmp_path, USUAL.but(**{"ranges": MIXED, **fields}))
    np.testing.assert_array_equal(laser.cleaned, (2.0,) * 89 + (math.inf, math.nan))
    assert assumed(log) == ({"range_min": 1} if fields.get("range_min") else {})


MILLIMETRES = {"ranges": np.linspace(1500.0, 3000.0, 91)}  # differ, and are no mark for beams without a return


@pytest.mark.parametrize("fields", [{"range_max": 1.0}, {"range_min": 3.0}, MILLIMETRES])
def test_limits_that_leave_no_range_are_named(tmp_path: Path, fields: dict[str, Any]) -> None:
    (laser,), log = read_scans(tmp_path, USUAL.but(**fields))
    assert assumed(log) == {"no_range_within": 1}
    (warning,) = linefix.scan_of(laser).warnings
    for message in (notes(log)["no_range_within"].message, warning.message):
        assert re.search("between range_min .* m and range_max .* m, but around", message)
        assert ("such as millimetres; expected metres" in message) == (fields is MILLIMETRES)


CLOCKWISE = USUAL.but(angle_min=math.pi / 2, angle_max=-math.pi / 2, angle_increment=-math.pi / 90)
STEP = math.pi / 90


@pytest.mark.parametrize(
    "laser",
    [
        USUAL,
        CLOCKWISE,
        USUAL.but(angle_max=math.pi / 2 + STEP),
        USUAL.but(angle_max=math.pi / 2 - STEP),
        CLOCKWISE.but(angle_max=-math.pi / 2 - STEP),
        USUAL.but(ranges=(2.0,), angle_max=-math.pi / 2),
        Laser((2.0,) * 360, 0.0, math.tau, math.tau / 360),
        Laser((2.0,) * 360, math.pi, -math.pi, -math.tau / 360),
    ],
)
def test_angles_that_agree_within_a_beam_are_taken(tmp_path: Path, laser: Laser) -> None:
    (found,), log = read_scans(tmp_path, laser)
    assert found.angle_increment == pytest.approx(laser.angle_increment)
    assert not assumed(log)


@pytest.mark.parametrize("step", [0.007, 0.03, 0.1])
def test_an_end_of_the_field_of_view_as_angle_max_is_a_note(tmp_path: Path, step: float) -> None:
    """velodyne_laserscan makes as many bins as fit into a turn, and sets angle_max to pi."""
    bins = int(math.tau / step)
    (found,), log = read_scans(tmp_path, Laser((2.0,) * bins, -math.pi, math.pi, step))
    assert found.angles[-1] == pytest.approx(-math.pi + (bins - 1) * step, abs=1e-4)
    off = (math.tau - step * (bins - 1)) / step
    assert f"({off:.3g} beams)" in (notes(log)["angle_max"].message if off > 1.5 else f"({off:.3g} beams)")
    filtered = Laser((2.0,) * 1070, -2.35, -2.35 + 0.004363 * 1080, 0.004363)
    assert "2.7 degrees" in notes(read_scans(tmp_path, filtered)[1])["angle_max"].message


@pytest.mark.parametrize(
    "laser",
    [
        USUAL.but(angle_min=math.pi / 2, angle_max=-math.pi / 2),  # mirrored
        USUAL.but(angle_increment=-STEP),
        Laser((2.0,) * 360, math.pi, -math.pi, math.tau / 360),
        Laser((2.0,) * 360, -math.pi, math.pi, -math.tau / 360),
        USUAL.but(angle_increment=2 * STEP),
        USUAL.but(angle_increment=0.0),
        USUAL.but(angle_max=0.0),
        USUAL.but(angle_max=-math.pi / 2),
        USUAL.but(angle_min=-90.0, angle_max=90.0, angle_increment=2.0),  # degrees
        USUAL.but(angle_max=math.nan),
        USUAL.but(angle_increment=math.nan),
        USUAL.but(angle_min=math.inf),
        USUAL.but(ranges=(2.0,) * 45),
        USUAL.but(ranges=(2.0,) * 93),
    ],
)
def test_angles_that_contradict_each_other_are_refused_by_name(tmp_path: Path, laser: Laser) -> None:
    lasers, log = read_scans(tmp_path, USUAL, laser, laser)
    assert len(lasers) == 1
    note = notes(log)["broken_scan"]
    assert note.count == 2
    assert all(name in note.message for name in ("angle_min", "angle_max", "angle_increment"))
    with pytest.raises(MalformedFileError, match=r"none of its 2 scans can be used; the first of them: .*angle_"):
        read_scans(tmp_path, laser, laser)


def test_a_scan_without_ranges_is_left_out(tmp_path: Path) -> None:
    lasers, log = read_scans(tmp_path, USUAL, USUAL.but(ranges=()))
    assert len(lasers) == 1
    assert counts(log)["broken_scan"] == 1


def stamped(tmp_path: Path, stamps: Sequence[int]) -> tuple[list[int], dict[str, int]]:
    recording = Recording(tmp_path / "a.mcap")
    for k, stamp in enumerate(stamps):
        recording.put("/scan", BEGUN + k * SECOND, scan_bytes(stamp))
    log = read_log(recording.done())
    return [scan.stamp_ns for scan in log], assumed(log)


def test_stamps_that_nobody_set_are_those_of_the_recorder(tmp_path: Path) -> None:
    assert stamped(tmp_path, [0, 0, 0]) == ([BEGUN, BEGUN + SECOND, BEGUN + 2 * SECOND], {"stamp_received": 3})


@pytest.mark.parametrize(
    ("stamps", "told"),
    [((5, 6, 7), {}), ((5, 5, 5, 6), {}), ((5, 4, 3, 9), {"stamp_back": 2}), ((5, 5, 4), {"stamp_back": 1})],
)
def test_stamps_that_jump_back_are_noted(tmp_path: Path, stamps: Sequence[int], told: dict[str, int]) -> None:
    wanted = [second * SECOND for second in stamps]
    assert stamped(tmp_path, wanted) == (wanted, told)


@pytest.mark.parametrize("mark", [b"\xef\xbb\xbf", b""])
def test_a_text_log_may_begin_with_a_byte_order_mark(tmp_path: Path, mark: bytes) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(mark + b"FLASER 3 1.0 2.0 3.0 0 0 0 0 0 0 7.5 host 7.5\n" * 2)
    log = read_log(path)
    assert len(list(log)) == 2
    path.write_text("FLASER 1 1.0 0 0 0 0 0 0 7.5 host 7.5\n", encoding="utf-16")
    with pytest.raises(MalformedFileError, match="UTF-16; save it as UTF-8"):
        list(read_log(path))
