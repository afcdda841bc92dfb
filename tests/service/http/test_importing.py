"""POST /v1/maps:import: files of other tools, also hostile ones, over HTTP."""

from __future__ import annotations

import base64
import gzip
import io
from pathlib import Path
from typing import Any

import httpx
import numpy as np
from PIL import Image

from formats import read_map
from linefix.documents import examples
from tests.service.importing.forms import TYPE, YAML, encoded, form, room_grid

URL = "/v1/maps:import"


def send(client: httpx.Client, files: dict[str, bytes], *fields: tuple[str, str], **headers: str) -> httpx.Response:
    return client.post(URL, content=bytes(form(files, *fields)), headers={"content-type": TYPE, **headers})


def refused(answer: httpx.Response, status: int, code: str) -> str:
    """Return the message, or the first place and its message."""
    problem: dict[str, Any] = answer.json()
    assert (answer.status_code, problem["code"]) == (status, code), answer.text
    assert len(answer.content) <= 8192
    first = (problem.get("errors") or [{"pointer": "", "message": problem["detail"]}])[0]
    return f"{first['pointer']}: {first['message']}"


def test_a_grid_becomes_a_map_that_can_be_put(client: httpx.Client, tmp_path: Path) -> None:
    files = room_grid()
    for name, content in files.items():
        (tmp_path / name).write_bytes(content)
    before = client.get("/v1/maps").json()
    answer = send(client, files)
    assert answer.status_code == 200, answer.text
    found = answer.json()
    expected = read_map(tmp_path / "room.yaml")
    assert np.array_equal(found["map"]["segments"], expected.map.segments.endpoints)
    assert (found["map"]["oriented"], found["map"]["frame_id"]) == (True, "map")
    assert (found["report"]["format"], found["report"]["files"]) == ("map_server", ["room.yaml", "room.pgm"])
    assert [note["code"] for note in found["report"]["read"]] == [note.code for note in expected.report.read]
    assert found["check"]["size"]["segment_count"] == len(expected.map.segments)
    assert client.get("/v1/maps").json() == before
    assert client.put("/v1/maps/imported", json=found["map"]).status_code == 201
    client.delete("/v1/maps/imported")
    picture = found["picture"]
    image = Image.open(io.BytesIO(base64.b64decode(picture["png"])))
    assert image.size == (200, 140)
    assert [image.getpixel(at) for at in ((100, 30), (70, 60), (2, 2))] == [254, 0, 205]
    assert (picture["pose"], picture["resolution"]) == ({"x": -1.0, "y": -2.0, "theta": 0.0}, 0.05)


def test_a_format_that_is_not_read(client: httpx.Client) -> None:
    assert "ends in one of .yaml" in refused(send(client, {"a.dwg": b"AC1032"}), 415, "unsupported_media_type")


def test_a_picture_of_a_hundred_million_pixels(client: httpx.Client) -> None:
    """100 KB that unpack to 100 MB."""
    bomb = encoded(Image.new("L", (10_000, 10_000), 254), "PNG")
    assert len(bomb) < 200_000
    assert "pixels" in refused(send(client, {"a.yaml": YAML % b"a.png", "a.png": bomb}), 413, "too_large")


def test_a_body_is_held_to_what_every_body_is(client: httpx.Client) -> None:
    packed = gzip.compress(form({"a.csv": b"0" * 40_000_000}))
    answer = client.post(URL, content=packed, headers={"content-type": TYPE, "content-encoding": "gzip"})
    assert "bytes, unpacked" in refused(answer, 413, "too_large")
    assert "multipart/form-data" in refused(client.post(URL, content=b"{}"), 415, "unsupported_media_type")
    assert client.get("/livez").status_code == 200


def scans_of(client: httpx.Client, files: dict[str, bytes], *fields: tuple[str, str]) -> httpx.Response:
    return client.post("/v1/scans:import", content=bytes(form(files, *fields)), headers={"content-type": TYPE})


def carmen(count: int) -> bytes:
    """A log of a laser of seven beams; the first range numbers the scans."""
    return "".join(
        f"FLASER 7 {1 + k}.0 2.0 3.0 3.0 3.0 3.0 3.0 0 0 0 0 0 0 {100 + k}.0 robot {100 + k}.0\n" for k in range(count)
    ).encode()


def test_scans_of_a_log_can_be_sent_as_they_are(client: httpx.Client) -> None:
    found = scans_of(client, {"drive.log": carmen(9)}, ("max_scans", "4"))
    assert found.status_code == 200, found.text
    answer = found.json()
    assert answer["count"] == 9
    # Evenly spread, the first among them.
    assert [scan["views"][0]["laser"]["ranges"][0] for scan in answer["scans"]] == [1.0, 3.0, 5.0, 7.0]
    assert answer["report"]["format"].startswith("carmen")
    asked = {"map": examples.MAP, "scan": answer["scans"][0]}
    found = client.post("/v1/associate", json=asked)
    assert found.json()["status"] in ("no_match", "ambiguous", "degenerate"), found.text
