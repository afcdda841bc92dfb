"""linefix map: import, check, draw, put, list, get, rm."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageDraw, ImageOps

from formats import read_map
from tests.map_quality.check.drawn import THICK, centre_lines, faces
from tests.running import RunningService
from tests.service.importing.forms import SQUARE, room_grid

from .drives import write_log
from .running import Linefix, refused


@pytest.fixture(autouse=True)
def _files(folder: Path) -> None:
    (folder / "maps").mkdir()
    for name, content in room_grid().items():
        (folder / "maps" / name).write_bytes(content)
    (folder / "plan.csv").write_bytes(SQUARE)
    (folder / "floor.json").write_text(json.dumps({"segments": faces().tolist()}))


def test_a_grid_becomes_a_map_file(linefix: Linefix, folder: Path) -> None:
    told = linefix.done("map", "import", "maps/room.yaml", "--out", "room.json", "--picture", "room.png")
    expected = read_map(folder / "maps" / "room.yaml").map
    assert json.loads((folder / "room.json").read_text())["segments"] == expected.segments.endpoints.tolist()
    assert [row.split()[0] for row in told.out.splitlines()[:3]] == ["from", "map", "read"]
    assert "room.yaml, room.pgm (map_server)" in told.out
    assert "wall surfaces are assumed" in told.out
    assert "finding" in told.out
    with Image.open(folder / "room.png") as picture:
        assert picture.size[0] > 1000


def test_what_a_drawing_does_not_say_is_said_by_options(linefix: Linefix) -> None:
    undirected = linefix.done("map", "import", "plan.csv", "--json").answer
    assert (undirected["map"]["oriented"], undirected["report"]["format"]) == (False, "csv")
    answer = linefix.done("map", "import", "plan.csv", "--units", "ft", "--point", "0.3", "0.3", "--json").answer
    assert answer["map"]["oriented"]
    assert answer["check"]["size"]["length"] == pytest.approx(14 * 0.3048)


@pytest.mark.parametrize("where", ["here", "at a server"])
def test_maps_are_stored_listed_and_forgotten(
    linefix: Linefix, folder: Path, patient: RunningService, where: str
) -> None:
    server = [] if where == "here" else ["--server", patient.url]
    name = f"hall.{len(server)}"

    def stored() -> list[dict[str, Any]]:
        """Return the map of this test alone: others share the server."""
        rows = [json.loads(row) for row in linefix("map", "list", "--json", *server).out.splitlines()]
        return [row for row in rows if row["map_id"] == name]

    assert re.search(r"^revision +1$", linefix("map", "put", name, "floor.json", *server).out, re.MULTILINE)
    (listed,) = stored()
    assert listed["segment_count"] == len(faces())
    assert "hall" in linefix("map", "list", *server).out
    found = linefix.done("map", "get", listed["map_id"], *server).answer
    assert found["segments"] == faces().tolist()
    assert "walls" in linefix("map", "check", listed["map_id"], *server).out
    linefix.done("map", "draw", listed["map_id"], "--out", "hall.png", *server)
    linefix.done("map", "rm", listed["map_id"], *server)
    assert f"{listed['map_id']}: no such file" in refused(linefix("map", "rm", listed["map_id"], *server), 3)
    assert stored() == []
    listing = " ".join(["linefix map list", *server])
    assert f"; {listing} shows the stored maps" in refused(linefix("map", "rm", listed["map_id"], *server), 3)


def test_a_check_beside_the_scans_of_a_log(linefix: Linefix, folder: Path) -> None:
    """A map that is mirrored, as one whose rows were not flipped: its scans fit when it is turned back."""
    write_log(folder / "drive.log", 5)
    mirrored = faces() * [1.0, -1.0, 1.0, -1.0]
    (folder / "mirrored.json").write_text(json.dumps({"segments": mirrored[:, [2, 3, 0, 1]].tolist()}))
    told = linefix("map", "check", "mirrored.json", "--log", "drive.log").out
    assert "finding  mirrored" in told
    assert "finding  thickness" not in told
    assert "of 5 usable" in told
    right = linefix("map", "check", "floor.json", "--log", "drive.log").out
    assert "of 5 usable; with the advice 5" in right
    assert 'set "sigma" of the map to' in right
    assert "oriented" not in right  # it is as advised


def test_a_finding_says_where(linefix: Linefix, folder: Path) -> None:
    walls = [*faces().tolist(), [1.0, 1.0, 1.05, 1.0], [2.0, 1.0, 2.05, 1.0]]
    (folder / "crumbs.json").write_text(json.dumps({"segments": walls}))
    assert re.search(
        r"finding  short_pieces: .* Near \(1.0, 1.0\), \(2.0, 1.0\)\.", linefix("map", "check", "crumbs.json").out
    )


def test_how_thick_walls_are_is_found_from_a_log(linefix: Linefix, folder: Path) -> None:
    write_log(folder / "drive.log", 5)
    walls = [{"type": "LineString", "coordinates": [line[:2], line[2:]]} for line in centre_lines().tolist()]
    features = [{"type": "Feature", "properties": {"thickness": 2 * THICK}, "geometry": wall} for wall in walls]
    (folder / "floor.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    asked = ("map", "import", "floor.geojson", "--local-metres", "--log", "drive.log")
    answer = linefix.done(*asked, "--json").answer
    assert float(answer["map"]["meta"]["thickness"]) == pytest.approx(THICK, abs=0.02)
    assert [note["code"] for note in answer["report"]["assumed"]] == ["thickness_found"]
    assert "from scans of drive.log" in answer["report"]["assumed"][0]["message"]
    # A thickness that is given stays, and the report says that scans show another.
    told = linefix(*asked, "--thickness", str(2 * THICK)).out
    assert "finding  mirrored" not in told  # though scans that fit badly fit a little better so
    assert re.search("finding  thickness: The scans fit better if walls are (19|20) cm thinner", told)
    assert "of 5 usable" in told


@pytest.mark.long
def test_the_surface_of_a_grid_is_found_from_a_log(linefix: Linefix, folder: Path) -> None:
    """A grid whose walls are drawn 0.1 m thicker on each side than they are: two cells."""
    write_log(folder / "drive.log", 5)
    grid = Image.new("L", (480, 280), 254)
    for x1, y1, x2, y2 in (centre_lines() + np.array([1, 6, 1, 6])) * 20:
        ImageDraw.Draw(grid).rectangle([min(x1, x2) - 4, min(y1, y2) - 4, max(x1, x2) + 3, max(y1, y2) + 3], fill=0)
    ImageOps.flip(grid).save(folder / "thick.pgm")
    (folder / "thick.yaml").write_text("image: thick.pgm\nresolution: 0.05\norigin: [-1, -6, 0]\n")
    answer = linefix.done("map", "import", "thick.yaml", "--log", "drive.log", "--json").answer
    assert float(answer["map"]["meta"]["surface"]) == pytest.approx(2.0, abs=0.3)
    assert "from scans of drive.log" in answer["report"]["assumed"][-1]["message"]
    told = linefix("map", "import", "thick.yaml", "--log", "drive.log", "--surface", "0").out
    assert "0.00 cells" in told
    assert "as an option states" in told
