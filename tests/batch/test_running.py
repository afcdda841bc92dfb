"""Many logs to one file: one row a scan, whatever happens on the way."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from association import MapIndex, Scan, associate
from batch import (
    POSES,
    FleetOptions,
    Lost,
    OtherRunError,
    Processes,
    UnreadableMapsError,
    UnreadableScansError,
    associate_many,
)
from batch.blocks import Block
from registration import MeasuredSegments, Segments
from tests.association.scenes import known
from tests.batch.logs import ROOM, SEEN, SEGMENTS, rows, without_times, write_log, write_room

SMALL = FleetOptions(block=8)
FLASER = "FLASER 4 1.0 2.0 81.91 3.0 10 20 1.5 9 20 0 100.25 host 100.25\n"


@dataclass(frozen=True)
class Here:
    """Does the work in this process; ends after some items, or loses those with a certain scan in them."""

    ends_after: int = 10**6
    deadly: int = -1

    def run(self, function: Callable[[Any], Any], items: Sequence[Any]) -> Iterator[tuple[Any, Any]]:
        for count, item in enumerate(items):
            if count == self.ends_after:
                raise KeyboardInterrupt
            if isinstance(item, Block) and item.start <= self.deadly < item.stop:
                yield item, Lost()
            else:
                yield item, function(item)


def test_rows_say_what_the_search_says(tmp_path: Path) -> None:
    log, out = write_log(tmp_path / "a.parquet", 3), tmp_path / "poses.parquet"
    summary = associate_many([log], write_room(tmp_path), out, SMALL, Here())
    index = MapIndex.build(Segments.from_array(np.array(ROOM, dtype=float)))
    scan = Scan(MeasuredSegments.from_segments(Segments.from_array(np.array(SEEN)), 0.02))
    expected = associate(index, scan)
    assert (summary.scans, summary.usable, summary.errors, summary.statuses) == (3, 3, 0, {"ok": 3})
    assert pq.read_schema(out).equals(POSES)
    for k, row in enumerate(rows(out)):
        assert (row["log"], row["index"], row["stamp"], row["map_id"]) == (str(log), k, k, "room")
        assert (row["status"], row["usable"], row["probability"]) == ("ok", True, expected.probability)
        assert (row["x"], row["y"], row["theta"]) == (
            known(expected.pose).x,
            known(expected.pose).y,
            known(expected.pose).theta,
        )
        np.testing.assert_array_equal(row["covariance"], known(expected.covariance).ravel())
        assert (row["reasons"], row["error"]) == ([], None)


def test_a_bad_scan_is_a_row_with_an_error_and_costs_no_other(tmp_path: Path) -> None:
    scans = [SEEN, None, [[1.0, 2.0, 3.0]], [[0.0, 0.0, 0.0, 0.0]], SEEN]
    log = write_log(tmp_path / "a.parquet", 5, segments=pa.array(scans, type=SEGMENTS))
    summary = associate_many([log], write_room(tmp_path), tmp_path / "out.parquet", SMALL, Here())
    found = rows(tmp_path / "out.parquet")
    assert [row["status"] for row in found] == ["ok", None, None, None, "ok"]
    assert [row["error"] is None for row in found] == [True, False, False, False, True]
    assert [row["usable"] for row in found] == [True, False, False, False, True]
    assert all(row["error"].startswith("invalid: ") for row in found[1:4])
    assert (summary.errors, summary.statuses) == (3, {"ok": 2})


def test_ranges_are_searched_with_their_beams(tmp_path: Path) -> None:
    angles = np.linspace(-np.pi, np.pi, 360, endpoint=False)
    with np.errstate(divide="ignore"):
        ranges = np.minimum(4.0 / np.abs(np.cos(angles)), 3.0 / np.abs(np.sin(angles)))
    table = pa.table(
        {
            "angle_min": [-np.pi] * 2,
            "angle_increment": [2 * np.pi / 360] * 2,
            "ranges": pa.array([ranges.tolist(), None], type=pa.list_(pa.float32())),
            "stamp": pa.array([5, None], type=pa.timestamp("us")),
        }
    )
    pq.write_table(table, tmp_path / "a.parquet")
    room = tmp_path / "hall.json"
    room.write_text("[[-4, -3, 4, -3], [4, -3, 4, 3], [4, 3, -4, 3], [-4, 3, -4, -3]]")
    associate_many([tmp_path / "a.parquet"], room, tmp_path / "out.parquet", SMALL, Here())
    first, second = rows(tmp_path / "out.parquet")
    assert (first["stamp"], first["status"]) == (5000, "ambiguous")  # a rectangle has two ends
    assert abs(first["x"]) + abs(first["y"]) < 0.05
    assert second["error"] == "invalid: scan: expected ranges or segments, found neither"


def test_scans_are_searched_in_the_map_that_they_name_or_their_log_is_named_as(tmp_path: Path) -> None:
    maps = tmp_path / "maps"
    maps.mkdir()
    for name in ("hall", "room"):
        write_room(maps, name)
    named = write_log(tmp_path / "a.parquet", 3, map_id=pa.array(["hall", "nowhere", None]))
    own = write_log(tmp_path / "room.parquet", 1)
    associate_many([named, own], maps, tmp_path / "out.parquet", SMALL, Here())
    found = rows(tmp_path / "out.parquet")
    assert [(row["map_id"], row["status"]) for row in found] == [
        ("hall", "ok"),
        ("nowhere", None),
        (None, None),
        ("room", "ok"),
    ]
    assert [row["error"] for row in found[1:3]] == [
        "invalid: nowhere: there is no such map",
        "invalid: map_id: nobody says which of the maps it lies on",
    ]


def test_a_log_of_another_tool_has_a_row_for_each_scan(tmp_path: Path) -> None:
    (tmp_path / "robot.log").write_text(FLASER * 20)
    summary = associate_many([tmp_path / "robot.log"], write_room(tmp_path), tmp_path / "out.parquet", SMALL, Here())
    found = rows(tmp_path / "out.parquet")
    assert [row["index"] for row in found] == list(range(20))
    assert {row["stamp"] for row in found} == {100_250_000_000}
    assert (summary.scans, summary.errors) == (20, 0)


def test_a_log_that_breaks_off_has_a_row_that_says_so(tmp_path: Path) -> None:
    (tmp_path / "broken.mcap").write_bytes(b"\x89MCAP0\r\n" + b"\0" * 50)
    log = write_log(tmp_path / "a.parquet", 2)
    associate_many([tmp_path / "broken.mcap", log], write_room(tmp_path), tmp_path / "out.parquet", SMALL, Here())
    first, *rest = rows(tmp_path / "out.parquet")
    assert "the rest of the log cannot be read" in first["error"]
    assert [row["status"] for row in rest] == ["ok", "ok"]


def test_a_run_that_was_ended_goes_on_where_it_was(tmp_path: Path) -> None:
    log, room, out = write_log(tmp_path / "a.parquet", 40), write_room(tmp_path), tmp_path / "out.parquet"
    associate_many([log], room, tmp_path / "whole.parquet", SMALL, Here())
    with pytest.raises(KeyboardInterrupt):
        associate_many([log], room, out, SMALL, Here(ends_after=3))
    assert not out.exists()
    told: list[tuple[str, int, int]] = []
    summary = associate_many([log], room, out, SMALL, Here(), lambda *step: told.append(step))
    assert (summary.scans, summary.taken_over) == (40, 24)
    searched = [done for stage, done, _ in told if stage == "searching"]
    assert searched == [24, 32, 40]
    assert without_times(rows(out)) == without_times(rows(tmp_path / "whole.parquet"))
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "a.parquet",
        "out.parquet",
        "room.json",
        "whole.parquet",
    ]


def test_a_run_of_another_kind_is_not_mixed_in(tmp_path: Path) -> None:
    log, room, out = write_log(tmp_path / "a.parquet", 40), write_room(tmp_path), tmp_path / "out.parquet"
    with pytest.raises(KeyboardInterrupt):
        associate_many([log], room, out, SMALL, Here(ends_after=3))
    with pytest.raises(OtherRunError, match="other logs, maps or options"):
        associate_many([log], room, out, FleetOptions(block=16), Here())
    write_log(log, 41)
    with pytest.raises(OtherRunError):
        associate_many([log], room, out, SMALL, Here())


def test_the_one_scan_that_ends_each_worker_is_found(tmp_path: Path) -> None:
    log, room, out = write_log(tmp_path / "a.parquet", 24), write_room(tmp_path), tmp_path / "out.parquet"
    summary = associate_many([log], room, out, SMALL, Here(deadly=13))
    found = rows(out)
    assert [row["index"] for row in found] == list(range(24))
    assert [row["index"] for row in found if row["error"] is not None] == [13]
    assert found[13]["error"].startswith("worker_lost: ")
    assert summary.statuses == {"ok": 23}


def test_a_run_whose_halves_were_begun_goes_on_with_the_rest(tmp_path: Path) -> None:
    log, room, out = write_log(tmp_path / "a.parquet", 16), write_room(tmp_path), tmp_path / "out.parquet"

    class Ends(Here):
        def run(self, function: Callable[[Any], Any], items: Sequence[Any]) -> Iterator[tuple[Any, Any]]:
            if any(isinstance(item, Block) and item.stop - item.start == 2 for item in items):
                raise KeyboardInterrupt
            yield from Here.run(self, function, items)

    with pytest.raises(KeyboardInterrupt):
        associate_many([log], room, out, SMALL, Ends(deadly=5))
    summary = associate_many([log], room, out, SMALL, Here())
    assert (summary.taken_over, [row["index"] for row in rows(out)]) == (12, list(range(16)))


def test_row_groups_larger_than_a_block_are_laid_out_anew(tmp_path: Path) -> None:
    log, room = write_log(tmp_path / "a.parquet", 40), write_room(tmp_path)
    small = tmp_path / "b.parquet"
    pq.write_table(pq.read_table(log), small, row_group_size=3)
    associate_many([log, small], room, tmp_path / "out.parquet", SMALL, Here())
    assert [row["index"] for row in rows(tmp_path / "out.parquet")] == [*range(40), *range(40)]
    assert [row["stamp"] for row in rows(tmp_path / "out.parquet")] == [*range(40), *range(40)]


@pytest.mark.long
def test_a_worker_killed_on_the_way_costs_no_row(tmp_path: Path) -> None:
    log, room, out = write_log(tmp_path / "a.parquet", 80), write_room(tmp_path), tmp_path / "out.parquet"
    killed: list[int] = []

    def kill_one(stage: str, done: int, total: int) -> None:
        children = Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text().split()
        workers = [int(pid) for pid in children if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]
        if stage == "searching" and done > 0 and not killed and workers:
            killed.append(workers[0])
            os.kill(workers[0], signal.SIGKILL)

    summary = associate_many([log], room, out, SMALL, Processes(2), kill_one)
    assert len(killed) == 1
    assert (summary.scans, summary.errors) == (80, 0)
    assert [row["index"] for row in rows(out)] == list(range(80))


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"x": [1.0]}, "expected a column ranges or segments, found x"),
        ({"ranges": [[1.0]], "angle_min": [0.0]}, "expected a column angle_increment"),
        ({"ranges": [["a"]], "angle_min": [0.0], "angle_increment": [0.1]}, "a list of numbers in ranges"),
        ({"segments": [1.0]}, "lists of four numbers"),
        ({"segments": [[[1.0]]], "stamp": [0.5]}, "nanoseconds"),
        ({"segments": [[[1.0]]], "map_id": [3]}, "text in map_id"),
        ({"segments": [[[1.0]]], "sigma": ["a"]}, "numbers in sigma"),
    ],
    ids=["no scans", "no angles", "no numbers", "no lists", "seconds", "number of a map", "sigma"],
)
def test_a_file_without_scans_is_refused_beforehand(tmp_path: Path, columns: dict[str, Any], said: str) -> None:
    pq.write_table(pa.table(columns), tmp_path / "a.parquet")
    with pytest.raises(UnreadableScansError, match=said):
        associate_many([tmp_path / "a.parquet"], write_room(tmp_path), tmp_path / "out.parquet", SMALL, Here())


def test_what_is_not_there_is_refused_beforehand(tmp_path: Path) -> None:
    room, out = write_room(tmp_path), tmp_path / "out.parquet"
    with pytest.raises(UnreadableScansError, match=r"gone\.parquet"):
        associate_many([tmp_path / "gone.parquet"], room, out, SMALL, Here())
    (tmp_path / "a.parquet").write_text("no Parquet")
    with pytest.raises(UnreadableScansError, match="is not a Parquet file"):
        associate_many([tmp_path / "a.parquet"], room, out, SMALL, Here())
    (tmp_path / "empty").mkdir()
    with pytest.raises(UnreadableMapsError, match="holds no map"):
        associate_many([tmp_path / "a.parquet"], tmp_path / "empty", out, SMALL, Here())
