"""One scan, or a log, on several maps by the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from rosbags.rosbag2 import Writer

from cli.inputs import FILES
from formats import MAP_SUFFIXES
from linefix.documents import examples
from tests.formats.bags import GRID, TYPES, grid_bytes, room_cells
from tests.map_quality.check.drawn import faces
from tests.running import RunningService

from .drives import write_log
from .running import Linefix

HALL = [[0.0, 0.0, 9.0, 0.0], [9.0, 0.0, 9.0, 4.5], [9.0, 4.5, 0.0, 4.5], [0.0, 4.5, 0.0, 0.0]]


@pytest.fixture
def files(tmp_path: Path) -> Path:
    floors = tmp_path / "floors"
    floors.mkdir()
    (floors / "hall.json").write_text(json.dumps({"segments": HALL}))
    (floors / "room.json").write_text(json.dumps({"segments": examples.WALLS, "frame_id": "room"}))
    (tmp_path / "scan.json").write_text(json.dumps({"segments": examples.SEEN}))
    return floors


def test_a_scan_is_located_on_files_a_folder_and_stored_maps(linefix: Linefix, files: Path) -> None:
    linefix.done("map", "put", "stored", "floors/room.json")
    for maps, name in [
        (("floors/hall.json", "floors/room.json"), "room"),
        (("floors",), "room"),
        (("floors/hall.json", "stored"), "stored"),
    ]:
        answer = linefix.done("locate", *maps, "scan.json", "--json").answer
        assert (answer["usable"], answer["map"]["map_id"]) == (True, name)
        assert answer["map"]["revision"] == (1 if name == "stored" else None)
        assert answer["pose"]["x"] == pytest.approx(1.0, abs=1e-6)
        assert [one["map_id"] for one in answer["maps"]] == [name, "hall"]
        assert answer["frame_id"] == "room"
    told = linefix("locate", "floors", "scan.json").out
    assert "room" in told.splitlines()[1]
    assert "no_match" in told


def test_the_table_of_maps_is_whole_in_a_narrow_terminal(
    linefix: Linefix, files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A terminal breaks long lines; a name or a number that is cut is lost."""
    monkeypatch.setenv("COLUMNS", "40")
    lines = linefix("locate", "floors", "scan.json").out.splitlines()
    head = next(number for number, line in enumerate(lines) if "status" in line)
    assert lines[head].split() == ["map_id", "revision", "status", "score", "probability", "pose"]
    assert {line.split()[0] for line in lines[head + 1 :]} == {"room", "hall"}
    assert "…" not in "".join(lines)


def test_the_server_answers_as_this_process(linefix: Linefix, files: Path, service: RunningService) -> None:
    url = str(service.client.base_url)
    here = linefix.done("locate", "floors", "scan.json", "--json").answer
    there = linefix.done("locate", "floors", "scan.json", "--json", "--server", url).answer
    for name in ("request_id", "timing_ms"):
        del here[name], there[name]
    assert there == here


def test_files_of_one_name_are_told_apart(linefix: Linefix, files: Path) -> None:
    (files.parent / "other").mkdir()
    (files.parent / "other" / "room.json").write_text(json.dumps({"segments": HALL}))
    answer = linefix.done("locate", "floors/room.json", "other/room.json", "scan.json", "--json").answer
    assert {one["map_id"] for one in answer["maps"]} == {"room", "room-2"}


def test_the_folder_of_a_bag_is_one_map(linefix: Linefix, files: Path) -> None:
    with Writer(files.parent / "bag", version=8) as writer:
        maps = writer.add_connection("/map", GRID, typestore=TYPES["cdr"])
        writer.write(maps, 0, grid_bytes(room_cells()))
    answer = linefix.done("locate", "bag", "floors/hall.json", "scan.json", "--json").answer
    assert {one["map_id"] for one in answer["maps"]} == {"bag", "hall"}


@pytest.mark.parametrize("mode", ["global", "track"])
def test_a_log_is_replayed_on_several_maps(linefix: Linefix, files: Path, mode: str) -> None:
    write_log(files.parent / "drive.log", 8)
    (files / "floor.json").write_text(json.dumps({"segments": faces().tolist()}))
    found = linefix.done("replay", "drive.log", "--map", "floors", "--mode", mode, "--json").lines
    usable = [line for line in found if line["usable"]]
    assert len(usable) >= 4
    assert {line["map_id"] for line in usable} == {"floor"}
    told = linefix.done(
        "replay", "drive.log", "--map", "floors/floor.json", "--map", "floors/hall.json", "--mode", mode,
        "--picture", "way.png",
    )  # fmt: skip
    row = next(line for line in told.out.splitlines() if line.startswith("floor "))
    assert int(row.split()[-1]) == len(usable)
    assert "picture   way-floor.png\n" in told.out + told.err
    assert (files.parent / "way-floor.png").exists()
    assert not (files.parent / "way-hall.png").exists()


def test_every_suffix_of_a_map_file_is_never_meant_as_an_id() -> None:
    """The command line has a list of its own: the readers of `formats` need its extra."""
    assert sorted(FILES) == sorted(MAP_SUFFIXES)
