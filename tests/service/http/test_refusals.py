"""Requests that are wrong: the status, the code, the place and what to send instead, as tables."""

from __future__ import annotations

import gzip
import json
from http import HTTPStatus
from typing import Any

import httpx
import pytest

from association import CancelledError
from linefix.documents import errors as schemas
from linefix.documents import examples
from linefix.documents.errors import Fault, InvalidRequestError
from service import errors
from service.http.problems import INTERNAL, KINDS, RAISED, TABLE, problem_of
from tests.association.scenes import known

from .wrong_requests import ASSOCIATE, BATCH, BODIES, LASER, PUT, REGISTER, ROOM, STATUSES, TAKEN, VECTORIZE, WRONG


@pytest.fixture(scope="module", autouse=True)
def _stored(service: Any) -> Any:
    service.client.put("/v1/maps/wrong", json={"segments": ROOM}).raise_for_status()
    yield
    service.client.delete("/v1/maps/wrong")


def send(client: httpx.Client, call: str, parts: Any, **headers: str) -> httpx.Response:
    """Send a request of a table: parts in place of those of a right one, or a body as it is."""
    method, path = call.strip().split(" ", 1)
    content = parts if isinstance(parts, bytes) else json.dumps({**BODIES.get(call, {}), **parts}).encode()
    return client.request(method, path, content=content, headers=headers)


def refused(response: httpx.Response, status: int, code: str) -> dict[str, Any]:
    """Return the problem of a response, which is whole, short, and of this status and code."""
    assert response.status_code == status, response.text
    assert response.headers["content-type"] == "application/problem+json"
    assert len(response.content) <= 8192
    problem: dict[str, Any] = response.json()
    assert (problem["status"], problem["code"], problem["type"]) == (status, code, f"urn:linefix:problem:{code}")
    assert problem["request_id"] == response.headers["x-request-id"]
    assert problem["title"]
    if errors := problem.get("errors"):
        first = ": ".join(filter(None, (errors[0]["pointer"], errors[0]["message"])))
        assert problem["detail"] == first + (f" (and {len(errors) - 1} more)" if len(errors) > 1 else "")
    return problem


@pytest.mark.parametrize(("call", "parts", "places", "said"), WRONG, ids=range(len(WRONG)))
def test_what_is_wrong_is_named(client: httpx.Client, call: str, parts: Any, places: str, said: str) -> None:
    response = send(client, call, parts)
    errors = refused(response, 422, "invalid_request")["errors"]
    assert " ".join(error["pointer"] for error in errors) == places
    assert said in errors[0]["message"]
    assert "cuckoo" not in response.text, "an id that was sent"


NOT_JSON = [
    *(b'{"map": NaN}', b'{"map": Infinity}', b'{"map": -Infinity}', b'{"a": "\\ud800"}', b'{"map": 1e400}', b'"\xff"'),
    *(b"[" * 100_000, b'{"a":' * 100_000, b"", b"{", b"[1,]", b"\xef\xbb\xbf{}", b"\x00"),
]


@pytest.mark.parametrize("call", [REGISTER, ASSOCIATE, BATCH, VECTORIZE, PUT])
def test_what_is_not_json_is_400(client: httpx.Client, call: str) -> None:
    for body in NOT_JSON:
        problem = refused(send(client, call, body), 400, "invalid_json")
        assert ("an unknown range is null" in problem["detail"]) == (b"NaN" in body or b"Infinity" in body)


@pytest.mark.parametrize(("call", "parts", "status", "code", "more"), STATUSES, ids=range(len(STATUSES)))
def test_each_status_has_its_code(
    client: httpx.Client, call: str, parts: Any, status: int, code: str, more: dict[str, str] | str
) -> None:
    response = send(client, call, parts)
    problem = refused(response, status, code)
    if isinstance(more, str):
        assert more in problem["detail"]
    else:
        assert more.items() <= dict(response.headers).items()


HEADS: list[tuple[dict[str, str], int, str]] = [
    *(({"content-type": one}, 200, "") for one in ("APPLICATION/JSON; charset=utf-8", "application/geo+json")),
    *(({"content-type": one}, 415, "") for one in ("", "text/plain", "text/json", "application/xml", "text/x+json")),
    *(({"content-type": one}, 415, "") for one in ("json", "application/x-www-form-urlencoded")),
    *(({"content-encoding": one}, 200, "") for one in ("gzip", "x-gzip", "GZIP", "identity, gzip")),
    *(({"content-encoding": one}, 200, "plain") for one in ("", "identity")),
    *(({"content-encoding": one}, 415, "") for one in ("br", "gzip, gzip", "deflate", "gzip, br")),
    ({"content-encoding": "gzip"}, 400, "plain"),
]


@pytest.mark.parametrize(("headers", "status", "kind"), HEADS, ids=str)
def test_media_types_and_encodings(client: httpx.Client, headers: dict[str, str], status: int, kind: str) -> None:
    body = json.dumps(examples.REGISTER).encode()
    packed = "content-encoding" in headers and kind != "plain"
    response = client.post("/v1/register", content=gzip.compress(body) if packed else body, headers=headers)
    assert response.status_code == status, response.text
    if status == 415:
        refused(response, 415, "unsupported_media_type")
        assert "content-encoding" not in headers or response.headers["accept-encoding"] == "gzip"


def test_ten_thousand_bad_rows_make_a_small_answer_without_an_echo(client: httpx.Client) -> None:
    body = {"map": {"segments": [["cuckoo", 0, 0, 0]] * 10_000, "cuckoo": "cuckoo"}, "client_ref": {"cuckoo": "cuckoo"}}
    response = send(client, ASSOCIATE, body)
    assert len(refused(response, 422, "invalid_request")["errors"]) == 20
    # The name of an unknown field may be in its pointer; its value is nowhere.
    assert response.text.replace("/map/cuckoo", "").count("cuckoo") == 0


def test_what_only_looks_like_a_mistake_is_taken(client: httpx.Client) -> None:
    for part in TAKEN:
        for call, body in ((VECTORIZE, {"laser": LASER | part}), (ASSOCIATE, {"scan": {"laser": LASER | part}})):
            assert send(client, call, body).status_code == 200, (call, part)


CONTROLS = ("%0A", "%0D%0A", "%0D", "%00", "%09", "%0B", "%1F", "%7F", "%C2%85", "%E2%80%A8", "%E2%80%A9")
GET_PATHS = ("/metrics", "/version", "/livez", "/v1/limits", "/v1/maps", "/docs", "/", "/v1/maps/m", "/v1/maps/m:check")


@pytest.mark.parametrize("path", GET_PATHS)
def test_a_path_with_a_control_character_is_refused(client: httpx.Client, path: str) -> None:
    """Class of attack: a proxy with a rule for a path, and the service behind it, read the path differently."""
    for control in CONTROLS:
        for sent in (path + control, path[:2] + control + path[2:], f"{path}{control}?a=b"):
            answer = client.get(sent)
            assert "control character" in refused(answer, 400, "invalid_http")["detail"]
            assert "linefix_" not in answer.text
    for method in ("HEAD", "POST", "PUT", "DELETE", "OPTIONS"):
        assert client.request(method, path + "%0A", content=b"{}").status_code == 400


def test_a_plain_path_is_what_it_was(client: httpx.Client) -> None:
    assert client.get("/metrics").status_code == 200
    assert client.get("/livez?a=%0A").status_code == 200  # what follows the path is no part of it
    for path in ("/%250A", "/v1/maps/%C3%A4", "/v1/maps/%20", "/metrics%20"):
        assert client.get(path).status_code in (404, 422)


def test_head_is_get_without_its_body(client: httpx.Client) -> None:
    for path in ("/livez", "/v1/limits", "/v1/maps/none", "/v1/maps/wrong:check"):
        read, head = client.get(path), client.head(path)
        assert (head.status_code, head.content) == (read.status_code, b"")
        assert head.headers["content-type"] == read.headers["content-type"]


def test_request_ids(client: httpx.Client) -> None:
    assert client.get("/livez", headers={"x-request-id": "robot-7/42"}).headers["x-request-id"] == "robot-7/42"
    for none in ("a b", "x" * 129):
        assert len(client.get("/livez", headers={"x-request-id": none}).headers["x-request-id"]) == 32


TREES = (errors.ServiceError, errors.StoreError, schemas.RequestError)


def test_a_code_is_one_row_and_an_exception_in_one_row() -> None:
    assert len(KINDS) == len(TABLE)
    assert len(RAISED) == sum(len(kind.raised_as) for kind in TABLE)
    assert all(HTTPStatus(kind.status) >= 400 and kind.title for kind in TABLE)


@pytest.mark.parametrize("tree", TREES)
def test_whatever_a_room_raises_is_in_the_table(tree: type[Exception]) -> None:
    assert tree.__subclasses__()
    for error in tree.__subclasses__():
        assert error in RAISED or error in TREES, error


def test_anything_else_is_a_defect_and_told_nothing_of() -> None:
    for error in (ValueError("secret"), ZeroDivisionError("secret"), errors.StoreError("secret")):
        assert problem_of(error) is None
    assert INTERNAL.kind.status == 500


def test_places_are_named_and_bounded() -> None:
    faults = [Fault("/" + "p" * 500, "m" * 500)] * 30
    problem = known(problem_of(InvalidRequestError(faults)))
    document = problem.as_json("id", lambda pointer: "/q" + pointer.removeprefix("/p"))
    assert document["detail"] == f"/q{'p' * 118}: {'m' * 200} (and 19 more)"
    assert document["errors"] == [{"pointer": "/q" + "p" * 118, "message": "m" * 200}] * 20
    long = known(problem_of(errors.NotReadyError("x" * 1000)))
    assert long.as_json("id")["detail"] == "x" * 400


def test_a_cancelled_request_is_told_why() -> None:
    problem = known(problem_of(CancelledError()))
    assert (problem.kind.code, problem.detail[:28]) == ("not_ready", "the service is shutting down")
