"""Points of maps over HTTP: stored, in the request, of several maps, imported, kept by updates."""

from __future__ import annotations

import io
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image

from tests.linefix.test_map_points import POSTS, ROOM, ROOMS, SCANNER, ranges

from ..importing.forms import TYPE, form

URL = "/v1/maps/pointed"
POINTS = POSTS.reshape(-1, 2).tolist()
MAP = {"segments": ROOMS.tolist(), "points": POINTS, "points_sigma": 0.03}
BARE = {"segments": ROOMS.tolist()}
SCAN = {
    "laser": {
        "angle_min": SCANNER.angle_min,
        "angle_increment": SCANNER.angle_increment,
        "ranges": np.nan_to_num(ranges(), posinf=99.0).round(4).tolist(),
        "range_max": 30.0,
    }
}


@pytest.fixture
def stored(client: httpx.Client) -> Iterator[dict[str, Any]]:
    yield client.put(URL, json=MAP).raise_for_status().json()
    client.delete(URL)


def usable(client: httpx.Client, map: Any) -> bool:
    answer = client.post("/v1/associate", json={"map": map, "scan": SCAN})
    assert answer.status_code == 200, answer.text
    found: bool = answer.json()["usable"]
    return found


def test_maps_that_differ_in_their_points_are_different_maps(client: httpx.Client, stored: dict[str, Any]) -> None:
    """Also for the cache of indices, in which the content of a map is its name."""
    assert stored["segment_count"] == 12
    far = {**MAP, "points": [[x, y + 40.0] for x, y in POINTS]}
    for _ in range(2):
        assert [usable(client, one) for one in (BARE, MAP, far, {"map_id": "pointed"})] == [False, True, False, True]
    assert client.get(URL).json() == MAP


def test_points_of_several_maps(client: httpx.Client, stored: dict[str, Any]) -> None:
    """Of two maps of the same room, the one with the posts that the scan shows is the robot's."""
    one = {"map_id": "bare", "segments": ROOM.tolist()}
    other = {"map_id": "posts", "segments": ROOM.tolist(), "points": POINTS, "points_sigma": 0.03}
    for maps in ([one, other], [other, one]):
        answer = client.post("/v1/associate", json={"maps": maps, "scan": SCAN}).json()
        assert (answer["usable"], answer["map"]["map_id"]) == (True, "posts")
    both_bare = client.post("/v1/associate", json={"maps": [one, {**one, "map_id": "twin"}], "scan": SCAN}).json()
    assert not both_bare["usable"]


def test_an_update_keeps_the_points(client: httpx.Client, stored: dict[str, Any]) -> None:
    scans = [{"visit": name, "scans": [SCAN]} for name in ("monday", "tuesday")]
    for answer in (
        client.post(f"{URL}:update", json={"visits": scans}).json(),
        client.post("/v1/maps:apply", json={"map": MAP, "changes": []}).json(),
    ):
        assert (answer["map"]["points"], answer["map"]["points_sigma"]) == (POINTS, 0.03)
        client.put(URL, json=answer["map"]).raise_for_status()
    bare = client.post("/v1/maps:apply", json={"map": BARE, "changes": []}).json()
    assert not bare["map"].keys() & {"points", "points_sigma"}


def test_an_imported_grid_has_points(client: httpx.Client) -> None:
    grid = np.full((80, 100), 205, dtype=np.uint8)
    grid[9:71, 9:91], grid[10:70, 10:90] = 0, 254
    grid[40, 50] = 0
    picture = io.BytesIO()
    Image.fromarray(grid[::-1]).save(picture, "PNG")
    yaml = "image: a.png\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    body = form({"a.yaml": yaml.encode(), "a.png": picture.getvalue()})
    imported = client.post("/v1/maps:import", content=bytes(body), headers={"content-type": TYPE})
    assert imported.status_code == 200, imported.text
    answer = imported.json()
    assert np.allclose(answer["map"]["points"], [[50.5 * 0.05, 40.5 * 0.05]])
    assert answer["map"]["points_sigma"] == 0.025
    assert client.put(URL, json=answer["map"]).status_code == 201
    client.delete(URL)


def test_an_analysis_sees_the_points(client: httpx.Client, stored: dict[str, Any]) -> None:
    asked = {"laser": {"beams": 360, "sigma": 0.01}, "spacing": 2.0}
    client.put("/v1/maps/bare", json=BARE).raise_for_status()
    found = [
        client.post(f"/v1/maps/{name}:analyze", json=asked).raise_for_status().json() for name in ("bare", "pointed")
    ]
    client.delete("/v1/maps/bare")
    assert found[0]["summary"]["usable"] == 0
    assert found[1]["summary"]["usable"] > 0
    right = [one["pose"]["x"] < 7.0 for one in found[1]["places"] if one["usable"]]
    assert any(right)
