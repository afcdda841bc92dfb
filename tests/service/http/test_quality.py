"""The quality of a map: :check, :analyze and :update, /v1/analyze, /v1/maps:apply."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest
from linefix_client import laser

from linefix.documents import examples
from registration import RigidTransform, Segments
from tests.map_quality.check.drawn import faces, sampled
from tests.map_quality.update.hall import PILLAR, PLACES, RACK, SCANNER, box, segments
from tests.service.asking import answered, scanned

CHECK = "/v1/maps/checked:check"


def put(client: httpx.Client, segments: Any) -> Any:
    return client.put("/v1/maps/checked", json={"segments": np.asarray(segments).tolist()}).raise_for_status().json()


def samples() -> list[dict[str, Any]]:
    """Return samples as a client sends them."""
    beams = [scan.beams for _, scan in sampled() if scan.beams]
    return [
        {"laser": laser(one.ranges, one.angles[0], one.angles[1] - one.angles[0], range_max=one.range_max)}
        for one in beams
    ]


def found_in(client: httpx.Client, segments: Any) -> dict[str, Any]:
    put(client, segments)
    return {one["code"]: one for one in client.get(CHECK).json()["findings"]}


def test_a_map_that_is_right(client: httpx.Client) -> None:
    revision = put(client, examples.WALLS)["revision"]
    answer = client.get(CHECK).raise_for_status().json()
    assert (answer["findings"], answer["complete"], answer["samples"]) == ([], True, None)
    assert answer["map"] == {"map_id": "checked", "revision": revision}
    assert answer["size"] == {"segment_count": 6, "walls": 6, "length": 28.0, "diagonal": 10.0}
    assert answer["advice"] == {"sigma": None, "oriented": True}
    assert answer["viewpoints"] > 0
    assert answer["timing_ms"].keys() == {"decode", "search", "total"}


def test_findings_name_segments(client: httpx.Client) -> None:
    found = found_in(client, [*examples.WALLS, [0.0, 0.0, 0.05, 0.0], [-3.0, -3.0, 2.0, -3.0]])
    assert found.keys() == {"short_pieces", "overlaps"}
    assert (found["short_pieces"]["segments"], found["short_pieces"]["count"]) == ([6], 1)
    assert found["overlaps"]["segments"] == [0, 7]
    many = [[x, 0.0, x + 0.05, 0.0] for x in np.arange(0.0, 1500.0, 1.0).tolist()]
    short = found_in(client, [*examples.WALLS, *many])["short_pieces"]
    assert (len(short["segments"]), short["count"]) == (1000, 1500)


def test_poses_in_another_frame(client: httpx.Client) -> None:
    put(client, faces())
    moved = [{"x": truth.x + 3.0, "y": truth.y, "theta": truth.theta} for truth, _ in sampled()]
    codes, unknown = (
        [one["code"] for one in answered(client, CHECK, scans=samples(), poses=poses)["findings"]]
        for poses in (moved, [None] * 6)
    )
    assert "moved" in codes
    assert unknown == [code for code in codes if code != "moved"]


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


UPDATE = "/v1/maps/updated:update"
HALL, TODAY = segments(RACK, PILLAR), segments(PILLAR)


@pytest.fixture
def _hall(client: httpx.Client) -> Iterator[None]:
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


@pytest.mark.usefixtures("_hall")
def test_a_removed_rack_is_proposed_not_stored_and_accepted_by_put(client: httpx.Client) -> None:
    found = answered(client, UPDATE, visits=days(TODAY, 3), client_ref=7)
    (change,) = found["changes"]
    assert (change["code"], change["segments"], change["new"]) == ("removed", [12, 13, 14, 15], [])
    told = change["evidence"]
    assert (told["visits"], told["from"], told["to"], change["accepted"]) == (3, "day 0", "day 2", True)
    assert found["map"]["segments"] == TODAY.endpoints.tolist()
    assert (found["map"]["frame_id"], found["map"]["meta"], found["map"]["sigma"]) == ("hall", {"floor": 3}, 0.005)
    assert (found["scans"], found["held_back"]["scans"], found["complete"], found["client_ref"]) == (24, 2, True, 7)
    assert found["sharpened"] == {"segments": [], "ends": [], "sigma": []}
    assert found["usable_before"] == found["usable_after"] == 24, "those that are held back included"
    kept = client.get("/v1/maps/updated")
    assert kept.json()["segments"] == HALL.endpoints.tolist()
    stored = client.put("/v1/maps/updated", json=found["map"], headers={"If-Match": kept.headers["ETag"]})
    assert stored.raise_for_status().json()["revision"] == found["based_on"]["revision"] + 1
    assert answered(client, UPDATE, visits=days(TODAY))["changes"] == []


@pytest.mark.usefixtures("_hall")
def test_visits_of_another_building_are_named(client: httpx.Client) -> None:
    elsewhere = Segments.from_array(np.array(examples.WALLS) * 1.7).shifted([7.0, 5.0])
    found = answered(client, UPDATE, visits=days(elsewhere))
    assert found["changes"] == []
    assert [one["visit"] for one in found["refused_visits"]] == ["day 0", "day 1"]


@pytest.mark.usefixtures("_hall")
def test_the_accepted_changes_of_a_proposal_are_applied_without_its_scans(client: httpx.Client) -> None:
    """As the update itself would have done, which was sent the same refusals."""
    old = {"segments": segments(RACK, PILLAR, box(9.1, 4.4, 9.7, 5.0)).endpoints.tolist(), "sigma": 0.005}
    client.put("/v1/maps/updated", json=old).raise_for_status()
    taken = days(segments(RACK))
    found, refused, unsure = (
        answered(client, UPDATE, visits=taken, **more) for more in ({}, {"refuse": [1]}, {"accept": 1})
    )
    assert [one["accepted"] for one in unsure["changes"]] == [False, False]
    assert sorted(one["segments"] for one in found["changes"]) == [[16, 17, 18, 19], [20, 21, 22, 23]]
    asked = {"map": old, "sharpened": found["sharpened"], "client_ref": "page"}
    whole = answered(client, "/v1/maps:apply", asked, changes=found["changes"])
    assert (whole["map"], whole["client_ref"]) == (found["map"], "page")
    assert whole["map"]["segments"] == segments(RACK).endpoints.tolist()
    some = [{**one, "accepted": number != 1} for number, one in enumerate(found["changes"])]
    assert answered(client, "/v1/maps:apply", asked, changes=some)["map"] == refused["map"] != found["map"]
