"""linefix analyze: as a user runs it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from PIL import Image

from tests.batch.logs import ROOM
from tests.running import RunningService

from .running import Linefix

BOX = [[1, 1, 1, 2], [1, 2, 2, 2], [2, 2, 2, 1], [2, 1, 1, 1]]
TWO = [*ROOM, *[[a + 20, b, c + 20, d] for a, b, c, d in ROOM]]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "room.json").write_text(json.dumps({"segments": ROOM}))
    (tmp_path / "two.json").write_text(json.dumps({"segments": TWO}))
    (tmp_path / "box.json").write_text(json.dumps(BOX))
    return tmp_path


@pytest.mark.long
def test_the_same_on_all_cores_and_from_a_server(folder: Path, service: RunningService, linefix: Linefix) -> None:
    """Enough places for several processes."""
    asked = "analyze two.json --spacing 0.9 --beams 180 --drive 1 --landmark box.json --json"
    here = linefix(*asked.split(), LINEFIX_SEARCHES="2")
    assert (here.code, here.err) == (0, "")
    answer = here.answer
    assert len(answer["places"]) == answer["summary"]["similar_pose"] > 30
    there = linefix.done(*asked.split(), "--server", service.url).answer
    for name in ("places", "summary", "complete", "spacing", "map"):
        assert answer[name] == there[name]
    assert answer["summary"]["resolved_within"] == 0
    assert answer["summary"]["usable_with_landmark"] > answer["summary"]["usable"] == 0


def test_files_of_it(folder: Path, linefix: Linefix) -> None:
    asked = ("analyze", "room.json", "--spacing", "1", "--out", "a.geojson", "--picture", "a.png")
    ended = linefix.done(*asked, "--drive", "2", "--landmark", "box.json")
    assert "usable" in ended.out
    assert re.search(r"^usable +2[0-4] \((8[3-9]|9\d|100) %\), simulated", ended.out, re.MULTILINE)
    assert "at once or after a drive" in ended.out
    assert "without people, and without furniture" in ended.out
    assert "with the landmark" in ended.out
    features = json.loads((folder / "a.geojson").read_text())["features"]
    assert len(features) > 15
    assert features[0]["geometry"]["type"] == "Point"
    assert features[0]["properties"]["status"] == "ok"
    with Image.open(folder / "a.png") as picture:
        colours = {colour: count for count, colour in picture.convert("RGB").getcolors(1 << 20) or []}
    assert colours[(0, 158, 115)] > 0.2 * sum(colours.values())


def test_little_time(folder: Path, linefix: Linefix) -> None:
    assert linefix.done("analyze", "two.json", "--deadline-ms", "1", "--json").answer["complete"] is False
