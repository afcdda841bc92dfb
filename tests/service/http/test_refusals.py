"""Rejected requests: problems, bounded, with pointers, and never a 500."""

from __future__ import annotations

import http.client
import time
from contextlib import suppress
from typing import Any

import httpx
import orjson
import pytest

from tests.running import JSON, RunningService

ROOM = [[-4.0, -3.0, 4.0, -3.0], [4.0, -3.0, 4.0, 3.0], [4.0, 3.0, -4.0, 3.0], [-4.0, 3.0, -4.0, -3.0]]


def associate_body(**parts: Any) -> dict[str, Any]:
    return {"map": {"segments": ROOM}, "scan": {"segments": ROOM}, **parts}


def refused(response: httpx.Response, status: int, code: str) -> dict[str, Any]:
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    assert len(response.content) <= 8192
    problem: dict[str, Any] = response.json()
    assert problem["status"] == status
    assert problem["code"] == code
    assert problem["request_id"] == response.headers["x-request-id"]
    assert {"type", "title", "detail"} <= problem.keys()
    return problem


@pytest.mark.parametrize(
    "body",
    [
        b'{"map": NaN}',
        b'{"map": Infinity}',
        b'{"map": -Infinity}',
        b'{"a": "\\ud800"}',
        b'{"map": 1e400}',
        b'"\xff"',
        b"[" * 100_000,
        b'{"a":' * 100_000,
        b"",
        b"{",
        b"[1,]",
        b"\xef\xbb\xbf{}",
        b"\x00",
    ],
)
@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("POST", "/v1/register"),
        ("POST", "/v1/associate"),
        ("POST", "/v1/associate:batch"),
        ("POST", "/v1/vectorize"),
        ("PUT", "/v1/maps/m"),
    ],
)
def test_what_is_not_json_is_400(client: httpx.Client, method: str, path: str, body: bytes) -> None:
    refused(client.request(method, path, content=body), 400, "invalid_json")


@pytest.mark.parametrize("bad", ["1.5", True, None, [1.0], {}, 1e10, -1e10, 10**30])
def test_numbers_are_strict(client: httpx.Client, bad: object) -> None:
    rows = [*ROOM, [0.0, 0.0, 1.0, bad]]
    for path, body, pointer in (
        ("/v1/associate", associate_body(map={"segments": rows}), "/map/segments/4"),
        ("/v1/associate", associate_body(scan={"segments": rows}), "/scan/segments/4"),
        ("/v1/register", associate_body(scan={"segments": rows}), "/scan/segments/4"),
        ("/v1/vectorize", {"points": [[0.0, 0.0], [bad, 1.0]]}, "/points/1"),
    ):
        problem = refused(client.post(path, content=orjson_dumps(body)), 422, "invalid_request")
        assert [error["pointer"] for error in problem["errors"]] == [pointer]


@pytest.mark.parametrize(
    ("options", "pointer"),
    [
        ({"confidence": "0.9"}, "/options/confidence"),
        ({"confidence": 1.1}, "/options/confidence"),
        ({"exhaustive": 1}, "/options/exhaustive"),
        ({"seed": True}, "/options/seed"),
        ({"seed": 1.5}, "/options/seed"),
        ({"seed": 2**64}, "/options/seed"),
        ({"max_alternatives": -1}, "/options/max_alternatives"),
        ({"include": ["everything"]}, "/options/include/0"),
        ({"estimator": "paper"}, "/options/estimator"),
        ({"confidnce": 0.9}, "/options/confidnce"),
        ({"deadline_ms": -1}, "/options/deadline_ms"),
        ([], "/options"),
    ],
)
def test_options_are_strict(client: httpx.Client, options: object, pointer: str) -> None:
    problem = refused(client.post("/v1/associate", json=associate_body(options=options)), 422, "invalid_request")
    assert [error["pointer"] for error in problem["errors"]] == [pointer]


@pytest.mark.parametrize(
    ("prior", "pointer"),
    [
        ({"x": 0, "y": 0, "theta": 0}, "/prior"),
        ({"x": 0, "y": 0, "theta": 0, "angle": 1}, "/prior/radius"),
        ({"x": 0, "y": 0, "theta": 0, "radius": 1}, "/prior/angle"),
        ({"x": 0, "y": 0, "theta": 0, "covariance": [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}, "/prior/covariance"),
        ({"x": 0, "y": 0, "theta": 0, "covariance": [[1, 1, 0], [0, 1, 0], [0, 0, 1]]}, "/prior/covariance"),
        ({"x": 0, "y": 0, "theta": 0, "covariance": [[1, 0], [0, 1], [0, 0]]}, "/prior/covariance/0"),
        ({"x": "0", "y": 0, "theta": 0, "radius": 1, "angle": 1}, "/prior/x"),
        (3, "/prior"),
    ],
)
def test_priors_are_strict(client: httpx.Client, prior: object, pointer: str) -> None:
    problem = refused(client.post("/v1/associate", json=associate_body(prior=prior)), 422, "invalid_request")
    assert problem["errors"][0]["pointer"] == pointer


@pytest.mark.parametrize(
    ("parts", "pointer", "names"),
    [
        ({"map": {}}, "/map", ["segments", "map_id"]),
        ({"map": {"segments": ROOM, "map_id": "m"}}, "/map", ["segments", "map_id"]),
        ({"scan": {}}, "/scan", ["segments", "laser", "points", "views"]),
        ({"scan": {"sigma": 0.1}}, "/scan", ["segments", "laser", "points"]),
        ({"scan": {"segments": ROOM, "laser": {}}}, "/scan", ["segments", "laser", "points"]),
        ({"scan": {"points": [], "laser": {}}}, "/scan", ["segments", "laser", "points"]),
        ({"prior": {"x": 0, "y": 0, "theta": 0}}, "/prior", ["covariance", "radius", "angle"]),
        (
            {"prior": {"x": 0, "y": 0, "theta": 0, "radius": 1, "covariance": []}},
            "/prior",
            ["covariance", "radius", "angle"],
        ),
    ],
)
def test_what_is_either_or_names_every_choice(
    client: httpx.Client, parts: dict[str, Any], pointer: str, names: list[str]
) -> None:
    problem = refused(client.post("/v1/associate", json=associate_body(**parts)), 422, "invalid_request")
    (error,) = problem["errors"]
    assert error["pointer"] == pointer
    assert error["message"].startswith("expected exactly one of")
    assert all(name in error["message"] for name in names)


def test_ten_thousand_bad_rows_make_a_small_answer_without_an_echo(client: httpx.Client) -> None:
    secret = "cuckoo"
    body = associate_body(map={"segments": [[secret, 0, 0, 0]] * 10_000, secret: secret}, client_ref={secret: secret})
    response = client.post("/v1/associate", json=body)
    problem = refused(response, 422, "invalid_request")
    assert len(problem["errors"]) == 20
    # The name of an unknown field may be in its pointer; what it holds is nowhere.
    assert response.text.replace(f"/map/{secret}", "").count(secret) == 0


def test_strange_names_are_not_echoed(client: httpx.Client) -> None:
    name = "<script>" * 3000
    response = client.post("/v1/associate", json=associate_body(options={name: 1}))
    problem = refused(response, 422, "invalid_request")
    assert problem["errors"] == [{"pointer": "/options", "message": "unknown field; correct its name or remove it"}]


@pytest.mark.parametrize(
    ("segments", "pointer"),
    [
        ([], "/map/segments"),
        ([[0, 0, 0, 0]], "/map/segments/0"),
        ([[0, 0, 1, 0], [0, 0, 1e-7, 0]], "/map/segments/1"),
        ([[0, 0, 1, 0], [0, 0, 10_001, 0]], "/map/segments/1"),
        ([[0, 0, 1, 0], [100_001, 0, 100_002, 0]], "/map/segments"),
        ([[0, 0, 1]], "/map/segments/0"),
        ([5], "/map/segments/0"),
        ("rows", "/map/segments"),
        ({}, "/map/segments"),
    ],
)
def test_maps_that_are_none(client: httpx.Client, segments: object, pointer: str) -> None:
    problem = refused(
        client.post("/v1/associate", json=associate_body(map={"segments": segments})), 422, "invalid_request"
    )
    assert problem["errors"][0]["pointer"] == pointer
    stored = refused(client.put("/v1/maps/none", json={"segments": segments}), 422, "invalid_request")
    assert stored["errors"][0]["pointer"] == pointer.removeprefix("/map")


def test_correspondences_out_of_range(client: httpx.Client) -> None:
    body = {**associate_body(), "correspondences": [[0, 0], [1, 4]]}
    problem = refused(client.post("/v1/register", json=body), 422, "invalid_request")
    assert problem["errors"][0]["pointer"] == "/correspondences/1"


def test_both_sigmas_zero(client: httpx.Client) -> None:
    body = {"map": {"segments": ROOM, "sigma": 0.0}, "scan": {"segments": ROOM, "sigma": 0.0}}
    refused(client.post("/v1/register", json=body), 422, "invalid_request")


def test_sets_of_different_length_need_correspondences(client: httpx.Client) -> None:
    body = {"map": {"segments": ROOM}, "scan": {"segments": ROOM[:3]}}
    problem = refused(client.post("/v1/register", json=body), 422, "invalid_request")
    assert problem["errors"][0]["pointer"] == "/correspondences"


def test_paths_and_methods(client: httpx.Client) -> None:
    refused(client.get("/nothing"), 404, "not_found")
    refused(client.get("/v1/maps/"), 404, "not_found")
    response = client.get("/v1/associate")
    refused(response, 405, "method_not_allowed")
    assert response.headers["allow"] == "POST"
    assert client.request("PATCH", "/livez").headers["allow"] == "GET, HEAD"
    assert client.post("/v1/maps/m").headers["allow"] == "DELETE, GET, HEAD, PUT"
    refused(client.request("BREW", "/livez"), 405, "method_not_allowed")


def test_whoever_can_be_read_can_be_asked_for_its_headers(client: httpx.Client) -> None:
    for path in ("/livez", "/v1/limits", "/v1/maps/none"):
        read, asked = client.get(path), client.head(path)
        assert (asked.status_code, asked.content) == (read.status_code, b"")
        assert asked.headers["content-type"] == read.headers["content-type"]


def test_a_body_that_is_too_large_is_told_so_to_who_sends_it_whole(service: RunningService) -> None:
    """Without a lingering end the client would find its connection broken before it reads the answer."""
    limit = service.client.get("/v1/limits").json()["max_body_bytes"]
    for _ in range(3):
        connection = http.client.HTTPConnection("127.0.0.1", service.port, timeout=20)
        connection.request("POST", "/v1/associate", b" " * (limit + 1), JSON)
        answer = connection.getresponse()
        assert (answer.status, orjson.loads(answer.read())["code"]) == (413, "too_large")
        connection.close()


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("split", [0, 60])
def test_a_wish_for_another_protocol_is_ignored(service: RunningService, apart: bool, split: int) -> None:
    """The body stays the body, wherever the pieces end; it is never taken for a request."""
    body = b"GET /v1/limits HTTP/1.1\r\nHost: localhost\r\n\r\n" if apart else orjson.dumps(associate_body())
    head = b"POST /v1/associate HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    head += b"Connection: Upgrade, HTTP2-Settings\r\nUpgrade: h2c\r\n"
    head += b"HTTP2-Settings: AAMAAABkAARAAAAAAAIAAAAA\r\nContent-Length: %d\r\n\r\n" % len(body)
    pieces = [head[:split], head[split:], body] if apart else [head[:split], head[split:] + body]
    answer = b""
    with service.connection() as connection, suppress(TimeoutError):
        for piece in pieces:
            connection.sendall(piece)
            time.sleep(0.1)
        while piece := connection.recv(65_536):
            answer += piece
            connection.settimeout(0.5)  # for a second answer, which there should not be
    assert answer.count(b"HTTP/1.1 ") == 1
    assert b"max_body_bytes" not in answer
    assert answer.startswith(b"HTTP/1.1 400 " if apart else b"HTTP/1.1 200 ")


def test_deep_free_values(client: httpx.Client) -> None:
    deep: Any = 1
    for _ in range(200):
        deep = [deep]
    problem = refused(client.post("/v1/associate", json=associate_body(client_ref=deep)), 422, "invalid_request")
    assert problem["errors"][0]["pointer"] == "/client_ref"


def test_request_ids(client: httpx.Client) -> None:
    assert client.get("/livez", headers={"x-request-id": "robot-7/42"}).headers["x-request-id"] == "robot-7/42"
    made = client.get("/livez", headers={"x-request-id": "a b"}).headers["x-request-id"]
    assert len(made) == 32
    assert client.get("/livez", headers={"x-request-id": "x" * 129}).headers["x-request-id"] != "x" * 129


def orjson_dumps(body: object) -> bytes:
    """Like json, but a long integer goes out as it is."""
    try:
        return orjson.dumps(body)
    except TypeError:
        import json

        return json.dumps(body).encode()
