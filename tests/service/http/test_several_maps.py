"""Several maps in one question, over HTTP."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from linefix.documents import examples
from tests.service.asking import HERE, answered, pose_json

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


def test_stored_maps_are_named_with_their_revision_and_found_by_prefix(client: httpx.Client) -> None:
    for name, segments in (("tower-1", HALL), ("tower-2", examples.WALLS)):
        assert client.put(f"/v1/maps/{name}", json={"segments": segments}).is_success
    named, found = (asked(client, maps) for maps in ([{"map_id": "tower-1"}, {"map_id": "tower-2"}], {"prefix": "to"}))
    assert named["map"] == {"map_id": "tower-2", "revision": 1}
    assert (found["map"], found["maps"]) == (named["map"], named["maps"])
    # A map that changed is searched as it is now.
    assert client.put("/v1/maps/tower-2", json={"segments": HALL}).status_code == 200
    assert asked(client, {"prefix": "tower-"})["usable"] is False


def test_equal_maps_are_both_listed(client: httpx.Client) -> None:
    twice = [{"map_id": name, "segments": examples.WALLS} for name in ("a", "b")]
    answer = asked(client, twice)
    assert (answer["status"], answer["usable"]) == ("ambiguous", False)
    assert [one["status"] for one in answer["maps"]] == ["ambiguous", "ambiguous"]
    (other,) = {"a", "b"} - {answer["map"]["map_id"]}
    assert answer["alternatives"][0]["map_id"] == other
    (reason,) = [one for one in answer["reasons"] if one["code"] == "similar_place"]
    assert f"the map {other}" in reason["message"]
    for known in ({"map_weights": {"b": 0.9999}}, {"prior": {**PRIOR, "map_id": "b"}}):
        assert asked(client, twice, **known)["map"]["map_id"] == "b"


def test_a_batch_is_searched_on_several_maps(client: httpx.Client) -> None:
    seen = {"segments": examples.SEEN}
    priors = [None, None, {**PRIOR, "map_id": "roof"}]
    scans = [seen, {"segments": [[0, 0, 0, 0]]}, seen]
    first, second, third = answered(client, "/v1/associate:batch", maps=MAPS, scans=scans, priors=priors)["results"]
    assert [one["map_id"] for one in first["result"]["maps"]] == ["room", "hall"]
    assert second["status_code"] == 422
    assert third["problem"]["errors"][0]["pointer"] == "/priors/2/map_id"
