"""linefix analyze: as a user runs it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from PIL import Image

from tests.batch.logs import ROOM
from tests.running import RunningService

from .running import Linefix

BOX = [[1, 1, 1, 2], [1, 2, 2, 2], [2, 2, 2, 1], [2, 1, 1, 1]]
TWO = [*ROOM, *[[a + 20, b, c + 20, d] for a, b, c, d in ROOM]]


@pytest.fixture(autouse=True)
def _files(folder: Path) -> None:
    (folder / "two.json").write_text(json.dumps({"segments": TWO}))
    (folder / "box.json").write_text(json.dumps(BOX))


@pytest.mark.long
def test_the_same_on_all_cores_and_from_a_server(folder: Path, service: RunningService, linefix: Linefix) -> None:
    """Enough places for several processes, where there are several cores."""
    asked = "analyze two.json --spacing 0.9 --beams 180 --drive 1 --landmark box.json --json"
    here = linefix(*asked.split())
    assert (here.code, here.err) == (0, "")
    answer = here.answer
    assert len(answer["places"]) == answer["summary"]["similar_pose"] > 30
    there = linefix.done(*asked.split(), "--server", service.url).answer
    for name in ("places", "summary", "complete", "spacing", "map"):
        assert answer[name] == there[name]
    assert answer["summary"]["resolved_within"] == 0
    assert answer["summary"]["usable_with_landmark"] > answer["summary"]["usable"] == 0


def test_files_of_it(folder: Path, linefix: Linefix) -> None:
    asked = ("analyze", "room.json", "--spacing", "1", "--picture", "a.png")
    ended = linefix.done(*asked, "--drive", "2", "--landmark", "box.json")
    told = {line.split()[0]: line.split()[1] for line in ended.out.splitlines()}
    assert int(told["places"]) >= int(told["usable"]) >= 20
    assert told["complete"] == "true"
    assert min(int(told[name]) for name in ("resolved_within", "usable_with_landmark")) >= 15
    assert "without people, and without furniture" in ended.out
    with Image.open(folder / "a.png") as picture:
        colours = {colour: count for count, colour in picture.convert("RGB").getcolors(1 << 20) or []}
    assert colours[(0, 158, 115)] > 0.2 * sum(colours.values())


def test_little_time(folder: Path, linefix: Linefix) -> None:
    assert linefix.done("analyze", "two.json", "--deadline-ms", "1", "--json").answer["complete"] is False
