"""/v1/analyze and /v1/maps/{map_id}:analyze."""

from __future__ import annotations

from collections import Counter
from typing import Any

import httpx
import numpy as np
import pytest

from linefix.documents import examples
from simulation import offices
from tests.service.asking import answered

LASER = {"fov": 6.2831853, "beams": 360, "range_max": 12.0, "sigma": 0.02}


def analyzed(client: httpx.Client, segments: Any, spacing: float, **more: Any) -> Any:
    return answered(client, "/v1/analyze", map={"segments": segments}, laser=LASER, spacing=spacing, **more)


def test_a_room(client: httpx.Client) -> None:
    """As a stored map, too."""
    url = "/v1/maps/analyzed"
    client.put(url, json={"segments": examples.WALLS}).raise_for_status()
    answer = answered(client, f"{url}:analyze", laser=LASER, spacing=1.0, client_ref="a")
    client.delete(url)
    assert (answer["complete"], answer["spacing"], answer["client_ref"]) == (True, 1.0, "a")
    assert answer["map"]["map_id"] == "analyzed"
    places, summary = answer["places"], answer["summary"]
    assert len(places) == summary["places"] > 20
    assert summary["usable"] == sum(one["usable"] for one in places) > 20
    assert (summary["places"] + summary["not_free"], summary["left_out"]) == (8 * 6, 0)
    assert all(-4 < one["pose"]["x"] < 4 and -3 < one["pose"]["y"] < 3 for one in places)
    assert Counter(one["status"] for one in places)["ok"] > 0.8 * len(places)
    sent = analyzed(client, examples.WALLS, 1.0)
    assert (sent["places"], sent["map"]) == (places, None)


def test_where_a_direction_is_free_there_is_no_probability(client: httpx.Client) -> None:
    answer = analyzed(client, [[-20, 0, 20, 0], [20, 2, -20, 2]], 1.0)
    told = {(one["status"], one["probability"] is None) for one in answer["places"]}
    assert ("degenerate", True) in told
    assert ("degenerate", False) not in told


def test_a_drive_and_something_added(client: httpx.Client) -> None:
    """In a rectangle the robot can be at either of two places, wherever it drives; a box in it tells them apart."""
    rectangle = [[0, 0, 8, 0], [8, 0, 8, 5], [8, 5, 0, 5], [0, 5, 0, 0]]
    box = [[1, 1, 1, 2], [1, 2, 3, 2], [3, 2, 3, 1], [3, 1, 1, 1]]
    plain, more = analyzed(client, rectangle, 2.0), analyzed(client, rectangle, 2.0, drive=2.0, landmark=box)
    assert {(one["resolved_after"], one["with_landmark"]) for one in plain["places"]} == {(None, None)}
    assert (plain["summary"]["resolved_within"], plain["summary"]["usable_with_landmark"]) == (None, None)
    assert (more["summary"]["usable"], more["summary"]["resolved_within"]) == (0, 0)
    told = [one["with_landmark"] for one in more["places"] if one["with_landmark"]]
    assert sum(one["usable"] for one in told) == more["summary"]["usable_with_landmark"] > 0.5 * len(told)
    assert {"status", "usable", "probability"} == set(told[0])


def test_two_equal_rooms_and_a_point_in_one_of_them(client: httpx.Client) -> None:
    rooms = [*examples.WALLS, *[[a + 20, b, c + 20, d] for a, b, c, d in examples.WALLS]]
    answer = analyzed(client, rooms, 1.0, point=[0, 0])
    for place in answer["places"]:
        assert (place["status"], place["usable"], place["reasons"][0]) == ("ambiguous", False, "similar_place")
        assert place["similar_pose"]["x"] == pytest.approx(place["pose"]["x"] + 20.0, abs=0.2)
    assert answer["summary"]["similar_pose"] == len(answer["places"]) > 20


def test_what_there_is_no_time_for_is_left_out(client: httpx.Client) -> None:
    walls = offices(np.random.default_rng(0)).segments.endpoints.tolist()
    answer = answered(client, "/v1/analyze", map={"segments": walls}, spacing=0.3, deadline_ms=500)
    assert answer["complete"] is False
    assert answer["summary"]["left_out"] > 1000
    assert answer["summary"]["places"] == len(answer["places"])
