"""/v1/maps/{map_id}:update."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest

from linefix.documents import examples
from registration import RigidTransform, Segments
from simulation import scan
from tests.map_quality.update.hall import PILLAR, PLACES, RACK, SCANNER, box, segments

URL = "/v1/maps/updated:update"
APPLY = "/v1/maps:apply"
HALL = segments(RACK, PILLAR)


@pytest.fixture(autouse=True)
def _stored(client: httpx.Client) -> Iterator[None]:
    document = {"segments": HALL.endpoints.tolist(), "sigma": 0.005, "frame_id": "hall", "meta": {"floor": 3}}
    client.put("/v1/maps/updated", json=document).raise_for_status()
    yield
    client.delete("/v1/maps/updated")


def visit(name: str, walls: Segments, seed: int, **more: Any) -> dict[str, Any]:
    rng, scans = np.random.default_rng(seed), []
    for x, y in PLACES:
        at = RigidTransform(x, y, rng.uniform(-math.pi, math.pi))
        ranges = np.nan_to_num(scan(walls, at, SCANNER, rng).ranges, posinf=99.0).round(4).tolist()
        laser = {"angle_min": SCANNER.angle_min, "angle_increment": SCANNER.angle_increment, "range_max": 20.0}
        scans.append({"laser": {**laser, "ranges": ranges}, **more})
    return {"visit": name, "scans": scans}


def days(*walls: Segments) -> list[dict[str, Any]]:
    return [visit(f"day {k}", one, k) for k, one in enumerate(walls)]


def test_a_removed_rack_is_proposed_not_stored_and_accepted_by_put(client: httpx.Client) -> None:
    today = segments(PILLAR)
    answer = client.post(URL, json={"visits": days(today, today, today), "client_ref": 7})
    assert answer.status_code == 200, answer.text
    found = answer.json()
    assert [(one["code"], one["segments"], one["new"]) for one in found["changes"]] == [
        ("removed", [12, 13, 14, 15], [])
    ]
    told = found["changes"][0]["evidence"]
    assert (told["visits"], told["from"], told["to"]) == (3, "day 0", "day 2")
    assert found["changes"][0]["accepted"]
    assert found["map"]["segments"] == today.endpoints.tolist()
    assert (found["map"]["frame_id"], found["map"]["meta"], found["map"]["sigma"]) == ("hall", {"floor": 3}, 0.005)
    assert (found["scans"], found["held_back"]["scans"], found["complete"], found["client_ref"]) == (24, 2, True, 7)
    assert found["sharpened"] == {"segments": [], "ends": [], "sigma": []}
    assert found["usable_after"] >= found["usable_before"] > 8

    kept = client.get("/v1/maps/updated")
    assert kept.json()["segments"] == HALL.endpoints.tolist()
    revision = found["based_on"]["revision"]
    stored = client.put("/v1/maps/updated", json=found["map"], headers={"If-Match": kept.headers["ETag"]})
    assert stored.status_code == 200, stored.text
    assert stored.json()["revision"] == revision + 1
    again = client.post(URL, json={"visits": days(today, today)}).json()
    assert again["changes"] == []


def test_changes_that_are_refused_or_unsure_are_listed_and_not_in_the_map(client: httpx.Client) -> None:
    today = segments(PILLAR)
    for more in ({"refuse": [0]}, {"accept": 1.0}):
        found = client.post(URL, json={"visits": days(today, today), **more}).json()
        assert [one["accepted"] for one in found["changes"]] == [False]
        assert found["map"]["segments"] == HALL.endpoints.tolist()
    answer = client.post(URL, json={"visits": days(today, today), "refuse": [4]})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["pointer"] == "/refuse"


def test_visits_of_another_building_are_named(client: httpx.Client) -> None:
    room = Segments.from_array(np.array(examples.WALLS) * 1.7)
    today = room.shifted([7.0, 5.0])
    found = client.post(URL, json={"visits": days(today, today)}).json()
    assert found["changes"] == []
    assert [one["visit"] for one in found["refused_visits"]] == ["day 0", "day 1"]


def test_a_deadline_ends_it_without_a_proposal(client: httpx.Client) -> None:
    today = segments(PILLAR)
    answer = client.post(URL, json={"visits": days(today, today, today), "deadline_ms": 60})
    if answer.status_code == 200:
        assert (answer.json()["changes"], answer.json()["complete"]) == ([], False)
    else:
        assert answer.json()["code"] == "deadline_exceeded"


def test_the_accepted_changes_of_a_proposal_are_applied_without_its_scans(client: httpx.Client) -> None:
    """As the update itself would have done, which was sent the same refusals."""
    crowded = segments(RACK, PILLAR, box(9.1, 4.4, 9.7, 5.0))
    client.put("/v1/maps/updated", json={"segments": crowded.endpoints.tolist(), "sigma": 0.005}).raise_for_status()
    old = client.get("/v1/maps/updated").json()
    today = segments(RACK)
    taken = days(today, today)
    found = client.post(URL, json={"visits": taken}).json()
    assert sorted(one["segments"] for one in found["changes"]) == [[16, 17, 18, 19], [20, 21, 22, 23]]
    body = {"map": old, "changes": found["changes"], "sharpened": found["sharpened"], "client_ref": "page"}
    whole = client.post(APPLY, json=body)
    assert whole.status_code == 200, whole.text
    assert whole.json()["map"] == found["map"]
    assert (whole.json()["map"]["segments"], whole.json()["client_ref"]) == (today.endpoints.tolist(), "page")
    body["changes"] = [{**one, "accepted": number != 1} for number, one in enumerate(found["changes"])]
    again = client.post(URL, json={"visits": taken, "refuse": [1]}).json()
    assert client.post(APPLY, json=body).json()["map"] == again["map"] != found["map"]
