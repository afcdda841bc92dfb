"""linefix map update."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from formats import thinned
from registration import RigidTransform, Segments
from simulation import scan
from tests.map_quality.update.hall import PILLAR, PLACES, RACK, SCANNER, segments
from tests.map_quality.update.rooms import FIRST, IN_HALL, SECOND, places_in, rooms
from tests.running import RunningService

from .drives import carmen, numbers
from .running import Linefix

HALL, TODAY = segments(RACK, PILLAR), segments(PILLAR)


REMOVED = (0xD5, 0x5E, 0x00)


def colours_of(path: Path) -> set[tuple[int, ...]]:
    with Image.open(path) as picture:
        return {colour for _, colour in picture.convert("RGB").getcolors(1 << 24)}


def write_visit(
    path: Path, walls: Segments, seed: int, places: Sequence[tuple[float, float]] = PLACES, *, odometry: bool = True
) -> None:
    """Write a log of a visit, as CARMEN does."""
    rng, lines = np.random.default_rng(seed), ["# a log\n"]
    for k, (x, y) in enumerate(places):
        pose = RigidTransform(x, y, rng.uniform(-math.pi, math.pi))
        at = numbers(pose) if odometry else "0 0 0"
        lines.append(carmen(100 + k, scan(walls, pose, SCANNER, rng).ranges, SCANNER, at, at))
    path.write_text("".join(lines))


@pytest.fixture(autouse=True)
def _files(folder: Path) -> None:
    (folder / "hall.json").write_text(json.dumps({"segments": HALL.endpoints.tolist(), "sigma": 0.005, "meta": "A 3"}))
    for day, walls in (("monday", TODAY), ("tuesday", TODAY)):
        write_visit(folder / f"{day}.log", walls, len(day))


def test_a_new_map_and_a_picture_of_the_changes(linefix: Linefix, folder: Path) -> None:
    told = linefix.done(
        "map", "update", "hall.json", "monday.log", "tuesday.log", "--out", "new.json", "--picture", "changes.png"
    )
    rows = dict(row.split("  ", 1) for row in told.out.splitlines())
    assert rows["change 0"].strip().startswith("removed near (")
    assert "(segments 12, 13, 14, 15) before, 0.00 m after; confidence 0.9" in rows["change 0"]
    assert "2 visits" in rows["change 0"]
    assert "of 16 usable before" in rows["scans"]
    new = json.loads((folder / "new.json").read_text())
    assert new["segments"] == TODAY.endpoints.tolist()
    assert (new["sigma"], new["meta"]) == (0.005, "A 3")
    assert REMOVED in colours_of(folder / "changes.png")
    with Image.open(folder / "changes.png") as picture:  # its number, in the middle of the rack
        middle = picture.convert("RGB").crop((360, 730, 376, 750))
        assert REMOVED in {colour for _, colour in middle.getcolors(1 << 24)}


def test_a_wall_that_stays_although_beams_pass_through_has_its_reason(linefix: Linefix, folder: Path) -> None:
    walls, today = (
        [*box, *HALL.endpoints[:12].tolist()] for box in ([[8, 5.5, 6, 5.5]], [[8, 5.5, 7.25, 5.5], [6.8, 5.5, 6, 5.5]])
    )
    (folder / "old.json").write_text(json.dumps({"segments": walls, "sigma": 0.005}))
    for k in range(3):
        write_visit(folder / f"{k}.log", Segments.from_array(np.array(today, dtype=float)), k)
    told = linefix.done("map", "update", "old.json", "0.log", "1.log", "2.log").out
    assert "kept       segments 0: beams pass through a part of the wall, and beams of a visit end on" in told


def test_one_visit_shows_no_change_and_says_so(linefix: Linefix) -> None:
    told = linefix.done("map", "update", "hall.json", "monday.log")
    assert "change     none; a change needs logs of two visits" in told.out.splitlines()


def test_a_server_proposes_the_same(linefix: Linefix, folder: Path, patient: RunningService) -> None:
    """Of a stored map; a change is refused there, too."""
    logs, server = ("monday.log", "tuesday.log", "--json"), ("--server", patient.url)
    linefix.done("map", "put", "hall-u", "hall.json", *server)
    here = linefix.done("map", "update", "hall.json", *logs).answer
    there = linefix.done("map", "update", "hall-u", *logs, "--refuse", "0", "--picture", "there.png", *server)
    found = there.answer
    assert [one["code"] for one in found["changes"]] == [one["code"] for one in here["changes"]] == ["removed"]
    assert found["map"]["segments"] == HALL.endpoints.tolist()
    assert (folder / "there.png").stat().st_size > 1000
    wrong = linefix("map", "update", "hall.json", *logs, *server)
    assert (wrong.code, wrong.out) == (2, "")
    assert "expected the id of a stored map with --server" in wrong.err


@pytest.mark.parametrize("where", ["here", pytest.param("server", marks=pytest.mark.long)])
def test_odometry_of_the_logs_localizes_scans_in_rooms_that_look_alike(
    where: str, linefix: Linefix, folder: Path, patient: RunningService
) -> None:
    old, today, places = rooms(), rooms(cupboards=[FIRST]), [*IN_HALL, *places_in(SECOND), *IN_HALL[::-1]]
    (folder / "rooms.json").write_text(json.dumps({"segments": old.endpoints.tolist(), "sigma": 0.005}))
    more = ("--json", *(("--server", patient.url) if where == "server" else ()))
    assert where == "here" or linefix("map", "put", "rooms", "rooms.json", *more).code == 0
    name = "rooms" if where == "server" else "rooms.json"
    logs = [f"day {k}.log" for k in range(3)]
    for odometry, expected in ((False, []), (True, [[32, 33, 34, 35]])):
        for k, log in enumerate(logs):
            write_visit(folder / log, today, k, places, odometry=odometry)
        told = linefix.done("map", "update", name, *logs, *more)
        assert [one["segments"] for one in told.answer["changes"]] == expected


def test_a_change_is_refused_by_its_number_or_for_its_confidence(linefix: Linefix, folder: Path) -> None:
    """Also of a stored map, which stays as it is."""
    linefix.done("map", "put", "hall", "hall.json")
    logs = ("hall", "monday.log", "tuesday.log")
    for more in (("--refuse", "0"), ("--accept", "1")):
        told = linefix.done("map", "update", *logs, *more, "--out", "new.json", "--json")
        assert [one["accepted"] for one in told.answer["changes"]] == [False]
        assert told.answer["based_on"] == {"map_id": "hall", "revision": 1}
        assert json.loads((folder / "new.json").read_text())["segments"] == HALL.endpoints.tolist()
    wrong = linefix("map", "update", *logs, "--refuse", "7")
    assert (wrong.code, "expected an index of the 1 proposed changes" in wrong.err) == (3, True)


@pytest.mark.parametrize("count", [3, 200, 228, 401, 455, 1597, 10_000])
def test_a_long_log_gives_as_many_scans_as_wanted_from_all_over_it(count: int) -> None:
    assert thinned([], 200) == ([], 0)
    numbers = list(range(count))
    taken = np.array(thinned(numbers, 200)[0])
    assert len(taken) == min(count, 200)
    steps = np.diff(taken)
    assert taken[0] == 0
    assert taken[-1] >= count - 2.0 * count / len(taken)
    assert steps.max() <= 2.0 * count / len(taken)
