"""The Python client against a real service, and against one that has too much to do."""

from __future__ import annotations

import asyncio
import json
import math
from typing import Any

import httpx
import numpy as np
import pytest
from linefix_client import (
    AsyncClient,
    BusyError,
    Client,
    Pose,
    ProblemError,
    UnreachableError,
    base_from_laser,
    covariance_from_ros,
    covariance_to_ros,
    laser,
    laser_from_base,
    schema,
)

from examples.running import free_port
from linefix.documents import examples
from registration import RigidTransform
from tests.running import RunningService, sending

ROOM: Any = examples.MAP
QUESTION: Any = examples.ASSOCIATE


def test_a_map_is_stored_and_a_scan_found_in_it(service: RunningService) -> None:
    with Client(service.url) as client:
        stored = client.put_map("of-a-client", ROOM)
        assert (stored["revision"], client.get_map("of-a-client")["segments"]) == (1, ROOM["segments"])
        assert "of-a-client" in [one["map_id"] for one in client.list_maps(limit=100)["maps"]]
        assert "findings" in client.check_map("of-a-client")
        answer = client.associate({"map": {"map_id": "of-a-client"}, "scan": QUESTION["scan"]})
        assert answer["map"] == {"map_id": "of-a-client", "revision": 1}
        with pytest.raises(ProblemError, match="revision_conflict") as refused:
            client.put_map("of-a-client", ROOM, revision=7)
        assert refused.value.status == 412
        client.delete_map("of-a-client", revision=1)
        with pytest.raises(ProblemError, match="unknown_map"):
            client.get_map("of-a-client")


@pytest.mark.long
def test_a_map_of_another_tool_is_imported_checked_by_scans_and_analyzed(patient: RunningService) -> None:
    rows = "".join(",".join(map(str, row)) + "\n" for row in ROOM["segments"])
    with Client(patient.url, timeout=300.0) as client:
        imported = client.import_map([("room.csv", f"x1,y1,x2,y2\n{rows}".encode())], {"units": "m"})
        assert len(imported["map"]["segments"]) == len(ROOM["segments"])
        with pytest.raises(ProblemError) as refused:
            client.import_map([("room.csv", b"x1,y1,x2,y2\n")], {"units": ["m", "mm"]})
        assert refused.value.errors[0]["pointer"] == "/units"
        client.put_map("imported-by-client", {"segments": imported["map"]["segments"]})
        checked = client.check_map("imported-by-client", {"scans": [QUESTION["scan"]]})
        assert checked["samples"] is not None
        assert [one["usable"] for one in checked["samples"]["scans"]] == [True]
        analyzed = client.analyze({"map": {"map_id": "imported-by-client"}, "spacing": 2.0})
        assert analyzed["map"] == {"map_id": "imported-by-client", "revision": 1}
        assert analyzed["complete"]
        client.delete_map("imported-by-client")


def test_the_event_loop_imports_as_well(patient: RunningService) -> None:
    async def ask() -> Any:
        async with AsyncClient(patient.url, timeout=300.0) as client:
            return await client.import_map([("room.csv", b"x1,y1,x2,y2\n0,0,6,0\n6,0,6,4\n")], {"units": "m"})

    assert len(asyncio.run(ask())["map"]["segments"]) == 2


def test_a_refusal_says_where(service: RunningService) -> None:
    with Client(service.url) as client, pytest.raises(ProblemError) as refused:
        client.vectorize({"laser": {"angle_min": 0.0, "angle_increment": 0.0, "ranges": [1.0]}})
    assert refused.value.code == "invalid_request"
    assert refused.value.errors[0]["pointer"].startswith("/laser/angle_increment")
    assert refused.value.request_id


def test_the_event_loop_has_the_same(service: RunningService) -> None:
    async def ask() -> Any:
        async with AsyncClient(service.url) as client:
            return await asyncio.gather(client.associate(QUESTION), client.version(), client.limits())

    answer, version, limits = asyncio.run(ask())
    with Client(service.url) as client:
        assert answer["pose"] == client.associate(QUESTION)["pose"]
    assert version["version"]
    assert limits["max_beams"] > 0


def test_both_clients_have_every_method() -> None:
    names = [name for name in vars(Client) if not name.startswith("_")]
    assert names == [name for name in vars(AsyncClient) if not name.startswith("_")]


def answer(status: int, body: Any) -> bytes:
    content = json.dumps(body).encode()
    head = b"HTTP/1.1 %d X\r\nConnection: close\r\nRetry-After: 0\r\nContent-Length: %d\r\n\r\n"
    return head % (status, len(content)) + content


BUSY = {"code": "overloaded", "detail": "too much to do"}


@pytest.mark.parametrize("status", [429, 503])
def test_a_busy_service_is_asked_again_when_it_says(status: int) -> None:
    with sending(answer(status, BUSY), answer(200, {"version": "1"})) as (url, asked):
        with Client(url) as client:
            assert client.version() == {"version": "1"}
        assert len(asked) == 2


def test_a_service_that_stays_busy_is_told() -> None:
    with sending(answer(503, BUSY)) as (url, asked):
        with Client(url, retries=2) as client, pytest.raises(BusyError, match="overloaded"):
            client.version()
        assert len(asked) == 3


def test_other_refusals_are_not_sent_again() -> None:
    with sending(answer(500, ["no problem document"])) as (url, asked):
        with Client(url) as client, pytest.raises(ProblemError, match="500 unknown"):
            client.version()
        assert len(asked) == 1


def test_nobody_there_is_an_error_of_its_own() -> None:
    with Client(f"http://127.0.0.1:{free_port()}") as client, pytest.raises(UnreachableError):
        client.version()


def test_ranges_are_sent_without_nan_or_infinity() -> None:
    told = laser([1.0, math.inf, math.nan, -math.inf], 0.0, 0.1, range_max=8.0)
    assert told["ranges"] == [1.0, 9.0, None, None]
    assert laser([math.inf], 0.0, 0.1)["ranges"] == [None]
    json.dumps(told, allow_nan=False)


def test_the_robot_is_found_behind_its_laser() -> None:
    """Against the same by the libraries' transforms, and the covariance against drawn poses."""
    seen, mount = Pose(2.0, 1.0, 0.7), Pose(0.3, -0.1, 2.0)
    covariance = [[4e-4, 1e-4, 2e-4], [1e-4, 9e-4, -1e-4], [2e-4, -1e-4, 6e-4]]
    base, spread = base_from_laser(seen, covariance, mount)
    expected = RigidTransform(*seen).compose(RigidTransform(*mount).inverse())
    np.testing.assert_allclose(base, (expected.x, expected.y, expected.theta), atol=1e-12)
    drawn = np.random.default_rng(1).multivariate_normal(seen, covariance, 20_000)
    poses = [tuple(Pose(*row).then(mount.inverse())) for row in drawn]
    assert spread is not None
    np.testing.assert_allclose(np.array(spread), np.cov(np.array(poses).T), atol=4e-5)
    back, again = laser_from_base(base, spread, mount)
    np.testing.assert_allclose(back, seen, atol=1e-12)
    assert again is not None
    np.testing.assert_allclose(np.array(again), np.array(covariance), atol=1e-12)
    assert base_from_laser(seen, None, mount)[1] is None


def test_covariances_go_to_ros_and_back() -> None:
    covariance = [[1.0, 2.0, 3.0], [2.0, 5.0, 6.0], [3.0, 6.0, 9.0]]
    full = covariance_to_ros(covariance)
    at = {0: 1.0, 1: 2.0, 5: 3.0, 6: 2.0, 7: 5.0, 11: 6.0, 30: 3.0, 31: 6.0, 35: 9.0}
    assert full == [at.get(k, 0.0) for k in range(36)]
    assert covariance_from_ros(full) == covariance
    assert covariance_from_ros(covariance_to_ros(None)) is None
    with pytest.raises(ValueError, match="36"):
        covariance_from_ros([0.0] * 9)


def test_its_types_are_those_of_the_document(service: RunningService) -> None:
    """After a change of the schema: `make client-types`."""
    schemas = httpx.get(service.url + "/openapi.json").json()["components"]["schemas"]
    for name, told in schemas.items():
        if "properties" not in told:
            continue
        typed = getattr(schema, name)
        assert {*typed.__annotations__} == {*told["properties"]}, name
        left_out = {key for key, kind in typed.__annotations__.items() if "NotRequired" in repr(kind)}
        assert {*typed.__annotations__} - left_out == {*told.get("required", [])}, name
