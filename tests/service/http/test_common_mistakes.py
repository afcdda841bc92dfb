"""Mistakes that callers make are named, with what to send instead; and what only looks like one is taken."""

from __future__ import annotations

from typing import Any

import httpx
import pytest

from .test_refusals import ROOM, associate_body, refused

MISSING = "expected this field, found none"
UNKNOWN = "unknown field; correct its name or remove it"


def test_angles_in_degrees_are_not_taken(client: httpx.Client) -> None:
    prior = {"x": 0.0, "y": 0.0, "theta": 80.0}
    laser = {"angle_min": -180.0, "angle_increment": 0.01, "ranges": [1.0] * 10}
    for body, pointer in (
        (associate_body(prior={**prior, "radius": 1.0, "angle": 1.0}), "/prior/theta"),
        (associate_body(prior={**prior, "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}), "/prior/theta"),
        (associate_body(scan={"laser": laser}), "/scan/laser/angle_min"),
    ):
        problem = refused(client.post("/v1/associate", json=body), 422, "invalid_request")
        assert [error["pointer"] for error in problem["errors"]] == [pointer]
        (error,) = problem["errors"]
        assert "radians" in error["message"]
        assert "degrees" in error["message"]
        assert "12.566" not in error["message"]


@pytest.mark.parametrize(
    ("matrix", "named"),
    [
        ([0.1] * 36, "yaw"),
        ([[0.1] * 6] * 6, "yaw"),
        ([0.1] * 9, "3 rows"),
        ([[0.1] * 3] * 2, "3 rows"),
        ([], "3 rows"),
    ],
)
def test_a_covariance_of_another_shape_is_one_fault(client: httpx.Client, matrix: object, named: str) -> None:
    """ROS gives 36 numbers in a row, of which (x, y, yaw) are those of rows and columns 0, 1 and 5."""
    prior = {"x": 0.0, "y": 0.0, "theta": 0.0, "covariance": matrix}
    problem = refused(client.post("/v1/associate", json=associate_body(prior=prior)), 422, "invalid_request")
    (error,) = problem["errors"]
    assert error["pointer"] == "/prior/covariance"
    assert named in error["message"]


def test_a_misspelt_field_is_named(client: httpx.Client) -> None:
    for body, wanted in (
        (associate_body(scan={"segement": ROOM}), {"/scan/segments": MISSING, "/scan/segement": UNKNOWN}),
        (associate_body(map={"id": "hq"}), {"/map/segments": MISSING, "/map/id": UNKNOWN}),
        (associate_body(scan={"ranges": [1.0]}), {"/scan/laser": MISSING, "/scan/ranges": UNKNOWN}),
    ):
        problem = refused(client.post("/v1/associate", json=body), 422, "invalid_request")
        assert {error["pointer"]: error["message"] for error in problem["errors"]} == wanted


def test_numbers_next_to_nothing_are_no_defect(client: httpx.Client) -> None:
    laser = {"angle_min": -3.0, "angle_increment": 0.1, "ranges": [2.0] * 50}
    for changed, status in (
        ({"angle_increment": 1e-200}, 422),
        ({"ranges": [5e-324] * 50}, 200),
        ({"ranges": [2.0, 5e-324] * 25, "range_min": 0.0}, 200),
        ({"angle_increment": 1e-320, "ranges": [10.0] * 50}, 422),
    ):
        for path, body in (
            ("/v1/vectorize", {"laser": laser | changed}),
            ("/v1/associate", associate_body(scan={"laser": laser | changed})),
        ):
            assert client.post(path, json=body).status_code == status, (path, changed)


def test_a_laser_scan_message_is_taken_with_all_its_fields(client: httpx.Client) -> None:
    laser = {"angle_min": -0.4, "angle_increment": 0.1, "ranges": [2.0] * 9, "range_max": 30.0}
    more = {"angle_max": 0.4, "time_increment": 0.0, "scan_time": 0.1, "intensities": [1.0] * 9}
    header = {"seq": 7, "stamp": {"sec": 12, "nanosec": 5}, "frame_id": "base_laser"}
    plain, full = (
        client.post("/v1/vectorize", json={"laser": one}).json() for one in (laser, laser | more | {"header": header})
    )
    assert plain["segments"] == full["segments"]


@pytest.mark.parametrize("angle_max", [None, 0.4, 0.5, 0.3, 0])
def test_the_last_angle_may_be_off_by_a_beam(client: httpx.Client, angle_max: float | None) -> None:
    first = -0.8 if angle_max == 0 else -0.4
    laser = {"angle_min": first, "angle_max": angle_max, "angle_increment": 0.1, "ranges": [2.0] * 9, "range_max": 30.0}
    assert client.post("/v1/vectorize", json={"laser": laser}).status_code == 200


@pytest.mark.parametrize(
    "changed",
    [
        {"angle_max": -0.4},
        {"angle_max": 22.9},
        {"angle_max": 0.6},
        {"angle_increment": -0.1},
        {"angle_increment": 0.05},
        {"ranges": [2.0] * 18},
    ],
)
def test_angles_that_contradict_each_other_are_named(client: httpx.Client, changed: dict[str, Any]) -> None:
    """A driver that sets one of the angles wrong turns, mirrors or stretches its scans."""
    laser = {"angle_min": -0.4, "angle_max": 0.4, "angle_increment": 0.1, "ranges": [2.0] * 9, "range_max": 30.0}
    view = {"laser": laser | changed, "pose": {"x": 0.0, "y": 0.0, "theta": 0.0}}
    for path, body, place in (
        ("/v1/vectorize", {"laser": laser | changed}, "/laser/angle_max"),
        ("/v1/associate", associate_body(scan={"laser": laser | changed}), "/scan/laser/angle_max"),
        ("/v1/associate", associate_body(scan={"views": [view]}), "/scan/views/0/laser/angle_max"),
    ):
        (error,) = refused(client.post(path, json=body), 422, "invalid_request")["errors"]
        assert error["pointer"] == place
        assert "angle_min" in error["message"]
        assert "angle_increment" in error["message"]


def test_a_laser_scan_s_header_fills_stamp_and_frame(client: httpx.Client) -> None:
    laser = {"angle_min": -0.4, "angle_increment": 0.1, "ranges": [2.0] * 9, "range_max": 30.0}
    stamp = {"sec": 12, "nanosec": 5}
    headed = laser | {"header": {"stamp": stamp, "frame_id": "base_laser"}}

    def told(**scan: Any) -> tuple[object, object]:
        answer = client.post("/v1/associate", json=associate_body(scan=scan)).json()
        return answer["stamp"], answer["child_frame_id"]

    assert told(laser=laser) == (None, "laser")
    assert told(laser=headed) == (stamp, "base_laser")
    assert told(laser=headed, stamp=3, frame_id="mine") == (3, "mine")
    assert told(laser=laser | {"header": {}}) == (None, "laser")
    assert told(laser=laser | {"header": {"frame_id": ""}}) == (None, "laser")
    batch = client.post("/v1/associate:batch", json={"map": {"segments": ROOM}, "scans": [{"laser": headed}]}).json()
    assert batch["results"][0]["result"]["child_frame_id"] == "base_laser"
    for header, pointer in (({"stmp": 1}, "/scan/laser/header/stmp"), (3, "/scan/laser/header")):
        body = associate_body(scan={"laser": laser | {"header": header}})
        problem = refused(client.post("/v1/associate", json=body), 422, "invalid_request")
        assert problem["errors"][0]["pointer"] == pointer
