"""Several maps in one question, over HTTP."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from linefix.documents import examples

HALL = [[0.0, 0.0, 9.0, 0.0], [9.0, 0.0, 9.0, 4.5], [9.0, 4.5, 0.0, 4.5], [0.0, 4.5, 0.0, 0.0]]
ASKED: dict[str, Any] = {
    "maps": [
        {"map_id": "hall", "segments": HALL, "frame_id": "hall_frame"},
        {"map_id": "room", "segments": examples.WALLS, "frame_id": "room_frame"},
    ],
    "scan": {"segments": examples.SEEN},
}
PRIOR = {"x": 1.0, "y": 0.5, "theta": 1.6, "radius": 2.0, "angle": 0.5}


def asked(client: httpx.Client, path: str = "/v1/associate", **parts: Any) -> httpx.Response:
    return client.post(path, json={**ASKED, **parts})


def test_the_map_of_the_pose_is_named_and_all_are_listed(client: httpx.Client) -> None:
    answer = asked(client).json()
    assert (answer["status"], answer["usable"]) == ("ok", True)
    assert answer["map"] == {"map_id": "room", "revision": None}
    assert answer["frame_id"] == "room_frame"
    assert (answer["pose"]["x"], answer["pose"]["y"]) == (pytest.approx(1.0, abs=1e-6), pytest.approx(0.5, abs=1e-6))
    assert {(pair["scan"], pair["map"]) for pair in answer["correspondences"]} == {(i, i) for i in range(6)}
    assert [one["map_id"] for one in answer["maps"]] == ["room", "hall"]
    assert answer["maps"][0].keys() == {"map_id", "revision", "status", "score", "probability", "pose"}
    assert answer["maps"][0]["pose"] == answer["pose"]
    assert answer["maps"][0]["probability"] == answer["probability"]
    assert answer["maps"][1]["status"] == "no_match"


def test_stored_maps_are_named_with_their_revision_and_found_by_prefix(client: httpx.Client) -> None:
    for name, segments in (("tower-1", HALL), ("tower-2", examples.WALLS)):
        assert client.put(f"/v1/maps/{name}", json={"segments": segments}).status_code in (200, 201)
    named = asked(client, maps=[{"map_id": "tower-1"}, {"map_id": "tower-2"}]).json()
    assert named["map"]["map_id"] == "tower-2"
    assert named["map"]["revision"] == 1
    found = asked(client, maps={"prefix": "tower-"}).json()
    assert (found["map"], found["maps"]) == (named["map"], named["maps"])
    # A map that changed is searched as it is now.
    assert client.put("/v1/maps/tower-2", json={"segments": HALL}).status_code == 200
    assert asked(client, maps={"prefix": "tower-"}).json()["usable"] is False


def test_equal_maps_are_both_listed(client: httpx.Client) -> None:
    twice = [{"map_id": name, "segments": examples.WALLS} for name in ("a", "b")]
    answer = asked(client, maps=twice).json()
    assert (answer["status"], answer["usable"]) == ("ambiguous", False)
    assert [one["status"] for one in answer["maps"]] == ["ambiguous", "ambiguous"]
    other = ({"a", "b"} - {answer["map"]["map_id"]}).pop()
    assert answer["alternatives"][0]["map_id"] == other
    (reason,) = [one for one in answer["reasons"] if one["code"] == "similar_place"]
    assert f"the map {other}" in reason["message"]
    weighed = asked(client, maps=twice, map_weights={"b": 0.9999}).json()
    assert weighed["map"]["map_id"] == "b"
    known = asked(client, maps=twice, prior={**PRIOR, "map_id": "b"}).json()
    assert known["map"]["map_id"] == "b"


def test_a_batch_is_searched_on_several_maps(client: httpx.Client) -> None:
    body = {"maps": ASKED["maps"], "scans": [ASKED["scan"], {"segments": [[0, 0, 0, 0]]}, ASKED["scan"]]}
    body["priors"] = [None, None, {**PRIOR, "map_id": "roof"}]
    response = client.post("/v1/associate:batch", json=body)
    assert response.status_code == 200, response.text
    first, second, third = response.json()["results"]
    assert first["result"]["map"]["map_id"] == "room"
    assert [one["map_id"] for one in first["result"]["maps"]] == ["room", "hall"]
    assert second["status_code"] == 422
    assert third["problem"]["errors"][0]["pointer"] == "/priors/2/map_id"
