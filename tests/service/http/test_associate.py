"""POST /v1/associate, :batch and /v1/vectorize."""

from __future__ import annotations

import math
from typing import Any

import httpx
import numpy as np
import pytest

from linefix.documents import examples
from linefix.warmup import ROOM, room_ranges

TURN = [-math.pi + math.tau * i / 720 for i in range(720)]


def associated(client: httpx.Client, **parts: Any) -> dict[str, Any]:
    response = client.post("/v1/associate", json={**examples.ASSOCIATE, **parts})
    assert response.status_code == 200, response.text
    answer: dict[str, Any] = response.json()
    return answer


def laser(**more: Any) -> dict[str, Any]:
    # From (0, 0) in the room: what the scanner reads there, one beam without return.
    ranges: list[float | None] = room_ranges(np.array(TURN)).tolist()
    ranges[17] = None
    return {"angle_min": TURN[0], "angle_increment": TURN[1] - TURN[0], "ranges": ranges, **more}


def test_the_example_is_found(client: httpx.Client) -> None:
    answer = associated(client, client_ref={"n": 1}, scan={**examples.ASSOCIATE["scan"], "stamp": [7, "s"]})
    assert (answer["status"], answer["usable"]) == ("ok", True)
    assert answer["pose"]["x"] == pytest.approx(1.0, abs=1e-6)
    assert answer["pose"]["y"] == pytest.approx(0.5, abs=1e-6)
    assert answer["pose"]["theta"] == pytest.approx(math.pi / 2, abs=1e-6)
    assert {(pair["scan"], pair["map"]) for pair in answer["correspondences"]} == {(i, i) for i in range(6)}
    assert (answer["frame_id"], answer["child_frame_id"]) == ("map", "laser")
    assert (answer["stamp"], answer["client_ref"], answer["map"]) == ([7, "s"], {"n": 1}, None)
    assert answer["unmatched_scan"] == []
    assert answer["segments"] is None
    assert answer["search"]["complete"] is True
    assert answer["timing_ms"].keys() == {"decode", "search", "total"}


def test_ranges_are_found_and_give_their_segments(client: httpx.Client) -> None:
    answer = associated(client, scan={"laser": laser(range_min=0.1, range_max=30.0), "sigma": None})
    assert answer["status"] == "ok"
    assert answer["pose"]["x"] == pytest.approx(0.0, abs=0.02)
    assert answer["pose"]["theta"] == pytest.approx(0.0, abs=0.01)
    assert len(answer["segments"]) >= len(ROOM)


def test_points_are_found(client: httpx.Client) -> None:
    points = [[r * math.cos(a), r * math.sin(a)] for r, a in zip(room_ranges(np.array(TURN)), TURN, strict=True)]
    answer = associated(client, scan={"points": points})
    assert answer["status"] == "ok"
    assert answer["pose"]["y"] == pytest.approx(0.0, abs=0.02)


def test_the_error_of_the_walls_is_estimated_where_it_is_null_or_left_out(client: httpx.Client) -> None:
    def variance(where: dict[str, Any]) -> float:
        return float(associated(client, map=where)["covariance"][0][0])

    def sent(**sigma: float | None) -> float:
        return variance({"segments": examples.WALLS, **sigma})

    assert sent() == sent(sigma=None)
    assert 3.0 * sent(sigma=0.0) < sent() < sent(sigma=0.05)
    for sigma in ({}, {"sigma": None}, {"sigma": 0.0}):
        document = {"segments": examples.WALLS, **sigma}
        assert client.put("/v1/maps/of-some-error", json=document).is_success
        assert variance({"map_id": "of-some-error"}) == sent(**sigma)
        assert client.get("/v1/maps/of-some-error").json() == document


def test_what_is_strange_about_a_scan_is_told(client: httpx.Client) -> None:
    def codes(scan: dict[str, Any]) -> list[str]:
        warnings = associated(client, scan=scan)["warnings"]
        assert all(warning["message"].endswith((".", "?")) for warning in warnings)
        return [warning["code"] for warning in warnings]

    good = laser(range_max=30.0)
    assert codes({"laser": good}) == []
    assert codes({"laser": {**good, "ranges": [2.0] * 400 + good["ranges"][400:]}}) == ["stuck_ranges"]
    assert "scan_exceeds_map" in codes({"laser": {**good, "ranges": [r and 3.28 * r for r in good["ranges"]]}})


def test_reasons_are_given_where_an_answer_is_not_usable(client: httpx.Client) -> None:
    assert associated(client)["reasons"] == []
    answer = associated(client, scan={"segments": examples.SEEN[:1]})
    assert not answer["usable"]
    assert answer["reasons"]
    assert all(reason.keys() == {"code", "message"} for reason in answer["reasons"])
    answer = associated(client, scan={"segments": []})
    assert [reason["code"] for reason in answer["reasons"]] == ["not_on_map"]


def test_numbers_beside_a_pose(client: httpx.Client) -> None:
    """Its critical wall, down to where alternatives were looked for, and the paper's measures of each alternative."""
    rectangle = {"segments": [[0, 0, 8, 0], [8, 0, 8, 5], [8, 5, 0, 5], [0, 5, 0, 0]]}
    corner = {"segments": [[-3.5, 1.0, -3.5, -3.0], [-3.5, -3.0, 2.5, -3.0]]}
    answer = associated(client, map=rectangle, scan=corner, options={"sampling": "random", "seed": 4})
    search = answer["search"]
    assert (search["sampling"], search["seed"]) == ("random", 4)
    assert 0.5 < search["complete_above"] < 1.0
    wall = answer["diagnostics"]["critical_wall"]
    assert wall["displacement"] > 1.0
    assert len(wall["scan"]) == len(wall["map"]) == 1
    assert math.hypot(*wall["direction"]) == pytest.approx(1.0)
    assert answer["alternatives"]
    for other in answer["alternatives"]:
        assert other["ambiguity"]["total"] >= 0.0
        assert 0.0 <= other["reliability"] <= 1.0


def test_the_prior_of_the_map_and_the_least_probability_decide_what_is_usable(client: httpx.Client) -> None:
    """Of a batch, too."""
    batch = {"map": examples.ASSOCIATE["map"], "scans": [examples.ASSOCIATE["scan"]]}
    half, sure = ({"on_map": on_map} for on_map in (0.5, 1.0))
    likely = [associated(client, options=options)["probability"] for options in (half, sure)]
    assert likely[0] < likely[1]
    for options, usable in ((half, False), (sure, True)):
        options = {**options, "usable_from": 0.5 * sum(likely)}
        answer = associated(client, options=options)
        assert (answer["usable"], answer["probability"] >= options["usable_from"]) == (usable, usable)
        assert (answer["status"], answer["reasons"] == []) == ("ok" if usable else "ambiguous", usable)
        together = client.post("/v1/associate:batch", json={**batch, "options": options}).json()
        assert together["results"][0]["result"]["usable"] is usable


def test_an_empty_scan_is_no_match(client: httpx.Client) -> None:
    for scan in ({"segments": []}, {"points": []}, {"laser": {**laser(), "ranges": [None] * 10}}):
        answer = associated(client, scan=scan)
        assert (answer["status"], answer["pose"], answer["usable"]) == ("no_match", None, False)


def test_only_what_is_asked_for_is_included(client: httpx.Client) -> None:
    names = {"correspondences", "alternatives", "segments", "missing_map"}
    assert names <= associated(client).keys()
    assert not names & associated(client, options={"include": []}).keys()
    assert names & associated(client, options={"include": ["missing_map"]}).keys() == {"missing_map"}


def test_priors_of_both_kinds_are_taken(client: httpx.Client) -> None:
    at = {"x": 1.0, "y": 0.5, "theta": 1.57}
    for prior in ({**at, "covariance": [[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]]}, {**at, "radius": 1.0, "angle": 0.5}):
        assert associated(client, prior=prior)["status"] == "ok"


def test_the_paper_s_estimator_has_no_covariance(client: httpx.Client) -> None:
    answer = associated(client, options={"estimator": "one_step", "rotation": "mitsuta"})
    assert answer["covariance"] is None
    assert answer["pose"]["x"] == pytest.approx(1.0, abs=1e-6)


def test_a_bad_scan_in_a_batch_is_one_error_item(client: httpx.Client) -> None:
    bad_prior = {"x": 0, "y": 0, "theta": 0, "radius": "far", "angle": 1}
    body = {
        "map": {"segments": examples.WALLS},
        "scans": [{"segments": examples.SEEN}, {"segments": [[0, 0, 1, 0], [1, 2, 3]]}, {"segments": examples.SEEN}, 5],
        "priors": [None, None, bad_prior, None],
    }
    response = client.post("/v1/associate:batch", json=body)
    assert response.status_code == 200
    results = response.json()["results"]
    assert [(item["index"], item["status_code"]) for item in results] == [(0, 200), (1, 422), (2, 422), (3, 422)]
    single = associated(client, options={})
    assert results[0]["result"]["pose"] == single["pose"]
    assert results[0]["result"]["correspondences"] == single["correspondences"]
    pointers = [item["problem"]["errors"][0]["pointer"] for item in results[1:]]
    assert pointers == ["/scans/1/segments/1", "/priors/2/radius", "/scans/3"]


def test_vectorize_finds_the_corner(client: httpx.Client) -> None:
    answer = client.post("/v1/vectorize", json=examples.VECTORIZE).json()
    assert len(answer["segments"]) == 2
    for name in ("point_counts", "centroids", "spreads", "sigmas", "rms"):
        assert len(answer[name]) == 2
    # Counter-clockwise, free space on the left: up the wall at x = 2, then back along y = 2.
    assert answer["segments"][0] == pytest.approx([2.0, 0.0, 2.0, 2.0], abs=0.05)
    assert answer["segments"][1] == pytest.approx([2.0, 2.0, 0.1, 2.0], abs=0.05)


def test_what_vectorize_gives_can_be_sent_back(client: httpx.Client) -> None:
    found = client.post("/v1/vectorize", json={"laser": laser(range_max=30.0)}).json()
    scan = {name: found[name] for name in ("segments", "point_counts", "centroids", "spreads")}
    answer = associated(client, scan={**scan, "sigma": found["sigmas"]})
    assert answer["status"] == "ok"
    assert answer["pose"]["x"] == pytest.approx(0.0, abs=0.02)
