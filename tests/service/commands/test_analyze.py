"""linefix analyze: as a user runs it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from PIL import Image

from tests.running import RunningService
from tests.service.commands.test_asking import ROOM, linefix, refused

TWO = [*ROOM, *[[a + 20, b, c + 20, d] for a, b, c, d in ROOM]]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "room.json").write_text(json.dumps({"segments": ROOM}))
    (tmp_path / "two.json").write_text(json.dumps({"segments": TWO}))
    return tmp_path


def test_the_same_on_all_cores_and_from_a_server(folder: Path, service: RunningService) -> None:
    """Enough places for several processes."""
    asked = ("analyze", "two.json", "--spacing", "0.9", "--beams", "180", "--json")
    here = linefix(folder, *asked, LINEFIX_SEARCHES="2")
    assert (here.returncode, here.stderr) == (0, "")
    answer = json.loads(here.stdout)
    assert len(answer["places"]) == answer["summary"]["look_alike"] > 30
    there = json.loads(linefix(folder, *asked, "--server", service.url).stdout)
    for name in ("places", "summary", "complete", "spacing", "map"):
        assert answer[name] == there[name]


def test_files_of_it(folder: Path) -> None:
    asked = ("analyze", "room.json", "--spacing", "1", "--out", "a.geojson", "--picture", "a.png")
    ended = linefix(folder, *asked)
    assert ended.returncode == 0, ended.stderr
    assert "usable" in ended.stdout
    assert "(92 %)" in ended.stdout
    features = json.loads((folder / "a.geojson").read_text())["features"]
    assert len(features) > 15
    assert features[0]["geometry"]["type"] == "Point"
    assert features[0]["properties"]["status"] == "ok"
    with Image.open(folder / "a.png") as picture:
        colours = {colour: count for count, colour in picture.convert("RGB").getcolors(1 << 20) or []}
    assert colours[(46, 125, 70)] > 0.2 * sum(colours.values())


def test_little_time(folder: Path) -> None:
    ended = linefix(folder, "analyze", "two.json", "--deadline-ms", "1", "--json")
    assert ended.returncode == 0, ended.stderr
    assert json.loads(ended.stdout)["complete"] is False


@pytest.mark.parametrize(
    ("more", "code", "said"),
    [
        (("--fov", "360"), 3, "/laser/fov"),
        (("--point", "100", "0"), 3, "/point"),
        (("--out", "a.txt"), 2, "--out"),
    ],
    ids=["degrees", "nowhere", "no format"],
)
def test_what_is_not_done(folder: Path, more: tuple[str, ...], code: int, said: str) -> None:
    assert said in refused(linefix(folder, "analyze", "room.json", *more), code)
