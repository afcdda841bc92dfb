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
from tests.map_quality.update.hall import PILLAR, PLACES, RACK, SCANNER, box, segments
from tests.service.asking import answered, scanned

URL = "/v1/maps/updated:update"
HALL, TODAY = segments(RACK, PILLAR), segments(PILLAR)


@pytest.fixture(autouse=True)
def _stored(client: httpx.Client) -> Iterator[None]:
    document = {"segments": HALL.endpoints.tolist(), "sigma": 0.005, "frame_id": "hall", "meta": {"floor": 3}}
    client.put("/v1/maps/updated", json=document).raise_for_status()
    yield
    client.delete("/v1/maps/updated")


def days(walls: Segments, count: int = 2) -> list[dict[str, Any]]:
    """Return the visits of so many days."""
    found = []
    for day in range(count):
        rng = np.random.default_rng(day)
        poses = [RigidTransform(x, y, rng.uniform(-math.pi, math.pi)) for x, y in PLACES]
        scans = [{"laser": scanned(pose, SCANNER, walls, rng)} for pose in poses]
        found.append({"visit": f"day {day}", "scans": scans})
    return found


def test_a_removed_rack_is_proposed_not_stored_and_accepted_by_put(client: httpx.Client) -> None:
    found = answered(client, URL, visits=days(TODAY, 3), client_ref=7)
    (change,) = found["changes"]
    assert (change["code"], change["segments"], change["new"]) == ("removed", [12, 13, 14, 15], [])
    told = change["evidence"]
    assert (told["visits"], told["from"], told["to"], change["accepted"]) == (3, "day 0", "day 2", True)
    assert found["map"]["segments"] == TODAY.endpoints.tolist()
    assert (found["map"]["frame_id"], found["map"]["meta"], found["map"]["sigma"]) == ("hall", {"floor": 3}, 0.005)
    assert (found["scans"], found["held_back"]["scans"], found["complete"], found["client_ref"]) == (24, 2, True, 7)
    assert found["sharpened"] == {"segments": [], "ends": [], "sigma": []}
    assert found["usable_after"] >= found["usable_before"] > 8
    kept = client.get("/v1/maps/updated")
    assert kept.json()["segments"] == HALL.endpoints.tolist()
    stored = client.put("/v1/maps/updated", json=found["map"], headers={"If-Match": kept.headers["ETag"]})
    assert stored.raise_for_status().json()["revision"] == found["based_on"]["revision"] + 1
    assert answered(client, URL, visits=days(TODAY))["changes"] == []


def test_changes_that_are_refused_or_unsure_are_listed_and_not_in_the_map(client: httpx.Client) -> None:
    for more in ({"refuse": [0]}, {"accept": 1.0}):
        found = answered(client, URL, visits=days(TODAY), **more)
        assert [one["accepted"] for one in found["changes"]] == [False]
        assert found["map"]["segments"] == HALL.endpoints.tolist()


def test_visits_of_another_building_are_named(client: httpx.Client) -> None:
    elsewhere = Segments.from_array(np.array(examples.WALLS) * 1.7).shifted([7.0, 5.0])
    found = answered(client, URL, visits=days(elsewhere))
    assert found["changes"] == []
    assert [one["visit"] for one in found["refused_visits"]] == ["day 0", "day 1"]


def test_a_deadline_ends_it_without_a_proposal(client: httpx.Client) -> None:
    answer = client.post(URL, json={"visits": days(TODAY, 3), "deadline_ms": 60})
    if answer.status_code == 200:
        assert (answer.json()["changes"], answer.json()["complete"]) == ([], False)
    else:
        assert answer.json()["code"] == "deadline_exceeded"


def test_the_accepted_changes_of_a_proposal_are_applied_without_its_scans(client: httpx.Client) -> None:
    """As the update itself would have done, which was sent the same refusals."""
    old = {"segments": segments(RACK, PILLAR, box(9.1, 4.4, 9.7, 5.0)).endpoints.tolist(), "sigma": 0.005}
    client.put("/v1/maps/updated", json=old).raise_for_status()
    taken = days(segments(RACK))
    found, refused = (answered(client, URL, visits=taken, **more) for more in ({}, {"refuse": [1]}))
    assert sorted(one["segments"] for one in found["changes"]) == [[16, 17, 18, 19], [20, 21, 22, 23]]
    asked = {"map": old, "sharpened": found["sharpened"], "client_ref": "page"}
    whole = answered(client, "/v1/maps:apply", asked, changes=found["changes"])
    assert (whole["map"], whole["client_ref"]) == (found["map"], "page")
    assert whole["map"]["segments"] == segments(RACK).endpoints.tolist()
    some = [{**one, "accepted": number != 1} for number, one in enumerate(found["changes"])]
    assert answered(client, "/v1/maps:apply", asked, changes=some)["map"] == refused["map"] != found["map"]
