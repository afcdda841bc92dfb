"""Bodies: packed, chunked, too large, too slow, and a batch whose answers are too large."""

from __future__ import annotations

import asyncio
import gzip
import random
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import orjson
import pytest
from starlette.requests import Request

from linefix.documents import examples
from service.admission.budget import ByteBudget
from service.errors import BodyTooSlowError
from service.http.bodies import receive_body
from tests.running import RunningService

PACKED = {"content-encoding": "gzip"}
LARGE = random.Random(0).randbytes(3 << 20)  # does not get smaller


def receive(timeout: float, pause: float = 0.0, waited: float = 0.0, worked: float = 0.0) -> None:
    """Receive a body that comes in pieces, the first byte of whose head came a while ago; then work on it and fail."""
    pieces = iter([(b"a", True), (b"b", False)])

    async def piece() -> dict[str, Any]:
        await asyncio.sleep(pause)
        body, more = next(pieces)
        return {"type": "http.request", "body": body, "more_body": more}

    async def run() -> None:
        arrived = asyncio.get_running_loop().time() - waited
        request = Request({"type": "http", "method": "POST", "path": "/", "headers": []}, piece)
        with ByteBudget(1000).account() as account:
            assert await receive_body(request, arrived, account, max_bytes=100, timeout=timeout) == b"ab"
            await asyncio.sleep(worked)
            raise ZeroDivisionError

    asyncio.run(run())


def test_head_and_body_have_one_time_to_arrive() -> None:
    """Work that takes long once the body is there is no fault of the client."""
    for told in ({"timeout": 60.0, "pause": 0.01, "waited": 30.0}, {"timeout": 1.0, "worked": 1.1}):
        with pytest.raises(ZeroDivisionError):
            receive(**told)
    for told in ({"pause": 0.2}, {"pause": 0.1, "waited": 0.29}):
        with pytest.raises(BodyTooSlowError, match=r"0\.3 s;"):
            receive(timeout=0.3, **told)


def answered(response: httpx.Response) -> dict[str, Any]:
    assert response.status_code == 200, response.text
    answer: dict[str, Any] = response.json()
    return {name: value for name, value in answer.items() if name not in ("request_id", "timing_ms")}


WAYS: dict[str, Callable[[bytes], dict[str, Any]]] = {
    "whole": lambda body: {"content": body},
    "chunked": lambda body: {"content": iter([body[:150], body[150:]])},
    "packed": lambda body: {"content": gzip.compress(body, mtime=0), "headers": PACKED},
}


@pytest.mark.parametrize("way", WAYS)
def test_a_body_is_the_same_and_has_the_same_limit_whichever_way_it_comes(narrow: RunningService, way: str) -> None:
    body = orjson.dumps(examples.REGISTER)
    plain = answered(narrow.client.post("/v1/register", content=body))
    for size in (len(body), 200_000):
        assert answered(narrow.client.post("/v1/register", **WAYS[way](body.ljust(size)))) == plain
    answer = narrow.client.post("/v1/register", **WAYS[way](body.ljust(200_001)))
    assert (answer.status_code, answer.json()["code"]) == (413, "too_large")
    assert answer.json()["detail"] == "expected a body of at most 200000 bytes, unpacked; found more"


ONE = gzip.compress(b"{}", mtime=0)
NOT_PACKED = {
    "not gzip": (b"not gzip", "is not gzip"), "nothing": (b"", "cut short"), "cut short": (ONE[:-4], "cut short"),
    "large, cut short": (gzip.compress(LARGE, 1)[:2_000_000], "cut short"),
    "more bytes": (ONE + b"more", "follow"), "a second member": (ONE * 2, "follow"),
    "a large one, and more bytes": (gzip.compress(LARGE, 1) + b"x", "follow"),
}  # fmt: skip


@pytest.mark.parametrize("kind", NOT_PACKED)
def test_what_is_not_one_member_of_gzip(client: httpx.Client, kind: str) -> None:
    sent, said = NOT_PACKED[kind]
    answer = client.post("/v1/register", content=sent, headers=PACKED)
    assert (answer.status_code, answer.json()["code"]) == (400, "invalid_json")
    assert said in answer.json()["detail"]


def test_what_unpacks_to_more_than_is_allowed_is_never_held(service: RunningService) -> None:
    """300 KB that would be 300 MB."""
    bomb = gzip.compress(bytes(300_000_000), 9)
    with service.grows_by_less_than(80.0):
        assert service.client.post("/v1/register", content=bomb, headers=PACKED).status_code == 413


def test_a_length_over_the_limit_is_refused_before_the_body_comes(service: RunningService) -> None:
    with service.connection() as connection:
        connection.sendall(b"POST /v1/associate HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99000000\r\n\r\n")
        head = connection.recv(4096)
    assert head.startswith(b"HTTP/1.1 413 ")
    assert b"connection: close" in head.lower()


def test_chunks_over_the_limit_are_refused_while_they_come(narrow: RunningService) -> None:
    sent = 0

    def endless() -> Iterator[bytes]:
        nonlocal sent
        for _ in range(10_000):
            sent += 10_000
            yield b" " * 10_000

    assert narrow.client.post("/v1/associate", content=endless()).status_code == 413
    assert sent < 20_000_000


def test_a_batch_ends_when_its_answers_are_too_much(narrow: RunningService) -> None:
    """They were kept as objects until the last one, 410 MB of them, and weighed after that."""
    verdicts = "linefix_verdicts_total"
    options = {"include": ["correspondences", "segments", "alternatives"]}

    def ask(scans: int) -> httpx.Response:
        body = {**examples.BATCH, "scans": [{"segments": examples.SEEN}] * scans, "priors": None, "options": options}
        return narrow.client.post("/v1/associate:batch", json=body)

    def found() -> float:
        rows = narrow.client.get("/metrics").text.splitlines()
        return sum(float(row.rsplit(" ", 1)[1]) for row in rows if row.startswith(verdicts))

    some = ask(20)
    assert (some.status_code, len(some.json()["results"])) == (200, 20)
    room, before = 200_000 * 20 // len(some.content), found()  # for so many
    many = ask(min(2 * room, 256))
    assert (many.status_code, many.json()["code"]) == (429, "rate_limited")
    assert found() - before < 1.25 * room
