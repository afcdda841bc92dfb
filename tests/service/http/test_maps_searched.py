"""Maps that are searched: several in one question, and their points."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest
from linefix_client import laser
from PIL import Image

from linefix.documents import examples
from tests.linefix.posts import POSTS, ROOMS, SCANNER, ranges
from tests.service.asking import HERE, answered, pose_json

from ..importing.forms import TYPE, YAML, encoded, form

HALL = [[0.0, 0.0, 9.0, 0.0], [9.0, 0.0, 9.0, 4.5], [9.0, 4.5, 0.0, 4.5], [0.0, 4.5, 0.0, 0.0]]
MAPS = [
    {"map_id": "hall", "segments": HALL, "frame_id": "hall_frame"},
    {"map_id": "room", "segments": examples.WALLS, "frame_id": "room_frame"},
]
PRIOR = {**pose_json(HERE), "radius": 2.0, "angle": 0.5}


def asked(client: httpx.Client, maps: Any = MAPS, **parts: Any) -> Any:
    return answered(client, "/v1/associate", maps=maps, scan={"segments": examples.SEEN}, **parts)


def test_the_map_of_the_pose_is_named_and_all_are_listed(client: httpx.Client) -> None:
    answer = asked(client)
    assert (answer["status"], answer["usable"], answer["frame_id"]) == ("ok", True, "room_frame")
    assert answer["map"] == {"map_id": "room", "revision": None}
    assert answer["pose"] == pytest.approx(pose_json(HERE), abs=1e-6)
    assert {(pair["scan"], pair["map"]) for pair in answer["correspondences"]} == {(i, i) for i in range(6)}
    best, other = answer["maps"]
    assert best.keys() == {"map_id", "revision", "status", "score", "probability", "pose"}
    assert (best["map_id"], best["pose"], best["probability"]) == ("room", answer["pose"], answer["probability"])
    assert (other["map_id"], other["status"]) == ("hall", "no_match")
    twice = [{"map_id": name, "segments": examples.WALLS} for name in ("a", "b")]
    assert asked(client, twice)["reasons"][0]["code"] == "similar_place"
    for known in ({"map_weights": {"b": 0.9999}}, {"prior": {**PRIOR, "map_id": "b"}}):
        assert asked(client, twice, **known)["map"]["map_id"] == "b"


def test_stored_maps_are_named_with_their_revision_and_found_by_prefix(client: httpx.Client) -> None:
    for name, segments in (("tower-1", HALL), ("tower-2", examples.WALLS)):
        assert client.put(f"/v1/maps/{name}", json={"segments": segments}).is_success
    named, found = (asked(client, maps) for maps in ([{"map_id": "tower-1"}, {"map_id": "tower-2"}], {"prefix": "to"}))
    assert named["map"] == {"map_id": "tower-2", "revision": 1}
    assert (found["map"], found["maps"]) == (named["map"], named["maps"])
    # A map that changed is searched as it is now.
    assert client.put("/v1/maps/tower-2", json={"segments": HALL}).status_code == 200
    assert asked(client, {"prefix": "tower-"})["usable"] is False


def test_a_batch_is_searched_on_several_maps(client: httpx.Client) -> None:
    seen = {"segments": examples.SEEN}
    priors = [None, None, {**PRIOR, "map_id": "roof"}]
    scans = [seen, {"segments": [[0, 0, 0, 0]]}, seen]
    first, second, third = answered(client, "/v1/associate:batch", maps=MAPS, scans=scans, priors=priors)["results"]
    assert [one["map_id"] for one in first["result"]["maps"]] == ["room", "hall"]
    assert second["status_code"] == 422
    assert third["problem"]["errors"][0]["pointer"] == "/priors/2/map_id"


URL = "/v1/maps/pointed"
POINTS = POSTS.reshape(-1, 2).tolist()
BARE = {"segments": ROOMS.tolist()}
MAP = {**BARE, "points": POINTS, "points_sigma": 0.03}
SCAN = {"laser": laser(ranges().round(4), SCANNER.angle_min, SCANNER.angle_increment, range_max=30.0)}


@pytest.fixture(autouse=True)
def _stored(client: httpx.Client) -> Iterator[None]:
    assert client.put(URL, json=MAP).raise_for_status().json()["segment_count"] == 12
    yield
    client.delete(URL)


def test_maps_that_differ_in_their_points_are_different_maps(client: httpx.Client) -> None:
    """Also for the cache of indices, in which the content of a map is its name."""
    far = {**MAP, "points": [[x, y + 40.0] for x, y in POINTS]}
    for _ in range(2):
        for one, usable in ((BARE, False), (MAP, True), (far, False), ({"map_id": "pointed"}, True)):
            assert answered(client, "/v1/associate", map=one, scan=SCAN)["usable"] is usable
    assert client.get(URL).json() == MAP


def test_an_update_keeps_the_points(client: httpx.Client) -> None:
    visits = [{"visit": name, "scans": [SCAN]} for name in ("monday", "tuesday")]
    for path, body in ((f"{URL}:update", {"visits": visits}), ("/v1/maps:apply", {"map": MAP, "changes": []})):
        found = answered(client, path, body)["map"]
        assert (found["points"], found["points_sigma"]) == (POINTS, 0.03)
        client.put(URL, json=found).raise_for_status()
    bare = answered(client, "/v1/maps:apply", map=BARE, changes=[])["map"]
    assert not bare.keys() & {"points", "points_sigma"}


def test_an_imported_grid_has_points(client: httpx.Client) -> None:
    grid = np.full((80, 100), 205, dtype=np.uint8)
    grid[9:71, 9:91], grid[10:70, 10:90] = 0, 254
    grid[40, 50] = 0
    picture = encoded(Image.fromarray(grid[::-1]), "PNG")
    body = bytes(form({"a.yaml": (YAML % b"a.png").replace(b"-1.0, -2.0", b"0.0, 0.0"), "a.png": picture}))
    imported = client.post("/v1/maps:import", content=body, headers={"content-type": TYPE}).raise_for_status().json()
    assert np.allclose(imported["map"]["points"], [[50.5 * 0.05, 40.5 * 0.05]])
    assert imported["map"]["points_sigma"] == 0.025
    assert client.put(URL, json=imported["map"]).is_success
