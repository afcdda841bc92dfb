"""Recordings with scans that cannot be used, as a user meets them: replay, map check, batch."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np

import linefix as library
from tests.batch.logs import ROOM
from tests.formats.bags import BEGUN, GRID, SECOND, Laser, Recording, grid_bytes, room_cells, scan_bytes

from .running import Linefix, refused

BEAMS = 360
SCANNER = library.simulation.Scanner(beams=BEAMS, angle_increment=math.tau / BEAMS, sigma=0.01, range_max=12.0)
WALLS = library.Segments.from_array(np.array(ROOM, dtype=float))


def seen(count: int) -> list[Laser]:
    step, found = SCANNER.angle_increment, []
    for k in range(count):
        pose = library.RigidTransform(1.0 + 0.3 * k, 1.0, 0.4 * k)
        ranges = library.simulation.scan(WALLS, pose, SCANNER, np.random.default_rng(k)).ranges
        found.append(Laser(ranges, SCANNER.angle_min, SCANNER.angle_min + (BEAMS - 1) * step, step, 0.05, 12.0))
    return found


def write(folder: Path, lasers: list[Laser]) -> None:
    recording = Recording(folder / "drive.mcap")
    for k, laser in enumerate(lasers):
        at = BEGUN + k * SECOND
        recording.put("/scan", at, scan_bytes(at, laser))
    recording.done()


REPLAY = ("replay", "drive.mcap", "--map", "room.json")
CHECK = ("map", "check", "room.json", "--log", "drive.mcap")
BATCH = ("batch", "drive.mcap", "--maps", "room.json", "--out", "poses.parquet", "--workers", "1")


def test_scans_whose_greatest_range_says_nothing_are_located(linefix: Linefix, folder: Path) -> None:
    write(folder, [laser.but(range_max=math.nan) for laser in seen(4)])
    ended = linefix.done(*REPLAY)
    assert "ok, usable      4" in ended.out
    assert "range_max is nan m" in ended.out
    assert "range_max is nan m" in linefix(*CHECK).err


def test_where_no_scan_is_left_it_is_said_why(linefix: Linefix, folder: Path) -> None:
    write(folder, [laser.but(angle_min=laser.angle_max, angle_max=laser.angle_min) for laser in seen(3)])
    for command in (REPLAY, CHECK):
        line = refused(linefix(*command), 3)
        assert "none of its 3 scans can be used" in line
        assert all(name in line for name in ("angle_min", "angle_max", "angle_increment"))
    ended = linefix(*BATCH)
    assert ended.code == 3
    assert "angle_increment" in ended.err


def test_some_scans_that_cannot_be_used_cost_no_others(linefix: Linefix, folder: Path) -> None:
    good, (bad,) = seen(3), seen(1)
    write(folder, [*good, bad.but(angle_increment=0.0)])
    ended = linefix.done(*REPLAY)
    assert "ok, usable      3" in ended.out
    assert "(1)" in next(line for line in ended.out.splitlines() if "angle_increment 0 rad" in line)
    summary = linefix.done(*BATCH, "--json").answer
    notes = {note["code"]: (note["kind"], note["count"]) for note in summary.pop("notes")}
    assert notes == {"no_odometry": ("assumed", 0), "broken_scan": ("dropped", 1)}
    assert summary == {"scans": 4, "taken_over": 0, "usable": 3, "errors": 1, "statuses": {"ok": 3}}


def test_a_batch_keeps_what_was_assumed_of_its_logs(linefix: Linefix, folder: Path) -> None:
    write(folder, [laser.but(range_max=0.0) for laser in seen(3)])
    (folder / "drive.mcap").rename(folder / "one.mcap")
    write(folder, [laser.but(range_max=0.0) for laser in seen(2)])
    ended = linefix.done(*BATCH[:1], "one.mcap", *BATCH[1:])
    rows = [line.split() for line in ended.out.splitlines()]
    assert ["usable", "5"] in rows
    assert [(*row[:2], *row[-2:]) for row in rows if "range_max" in row[2:3]] == [("one.mcap", "assumed", "5", "2")]


def test_the_grid_of_a_recording_that_is_the_map_is_named(linefix: Linefix, folder: Path) -> None:
    write(folder, seen(2))
    recording = Recording(folder / "maps.mcap")
    for topic in ("/map", "/local_costmap/costmap"):
        recording.put(topic, BEGUN, grid_bytes(room_cells()), GRID)
    recording.done()
    (folder / "points.json").write_text(json.dumps({"segments": [[0, -1, 2, -1], [2, -1, 2, 1]]}))
    replay = ("replay", "drive.mcap", "--map", "maps.mcap", "--picture", "poses.png")
    for command in (("locate", "maps.mcap", "points.json"), replay):
        ended = linefix.done(*command)
        assert ended.err.count("the grid of /map (60 x 50 cells of 0.1 m) is the map; not /local_costmap") == 1
        assert ended.err.count("grids of /map, of which the last is used (1)") == 1
    assert "the grid of" not in linefix("locate", "room.json", "points.json").err
