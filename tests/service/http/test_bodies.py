"""Bodies: packed, chunked, too large, too slow."""

from __future__ import annotations

import asyncio
import gzip
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Any

import httpx
import orjson
import pytest
from starlette.requests import Request

from linefix.documents import examples
from linefix.documents.errors import BodyTooLargeError
from service.admission.budget import ByteBudget
from service.admission.errors import TooMuchHeldError
from service.http.bodies import BodyReceiver
from service.http.errors import BodyTooSlowError, EncodingError, MediaTypeError
from tests.running import RunningService

PACKED = {"content-encoding": "gzip"}
LIMIT = 100


def request_of(pieces: list[bytes], pause: float = 0.0, **headers: str) -> Request:
    """A request whose body comes in pieces."""
    coming = iter([*((piece, True) for piece in pieces[:-1]), (pieces[-1], False)])

    async def receive() -> dict[str, Any]:
        await asyncio.sleep(pause)
        body, more = next(coming)
        return {"type": "http.request", "body": body, "more_body": more}

    named = [(name.replace("_", "-").encode(), value.encode()) for name, value in headers.items()]
    return Request({"type": "http", "method": "POST", "path": "/", "headers": named}, receive)


def received(receiver: BodyReceiver, request: Request, waited: float = 0.0) -> tuple[bytes, bool]:
    """Return what is received of a request whose first byte came a while ago."""

    async def run() -> tuple[bytes, bool]:
        arrived = asyncio.get_running_loop().time() - waited
        async with receiver.receiving(request, arrived) as body:
            return bytes(body.data), body.gzipped

    return asyncio.run(run())


def receiver_of(budget: int = 1000, timeout: float = 5.0) -> BodyReceiver:
    return BodyReceiver(LIMIT, ByteBudget(budget), timeout)


def test_a_body_comes_whole() -> None:
    for pieces in ([b"abc"], [b"a", b"b", b"c"], [b"", b"abc", b""]):
        assert received(receiver_of(), request_of(pieces)) == (b"abc", False)
    assert received(receiver_of(), request_of([b""])) == (b"", False)


@pytest.mark.parametrize("pieces", [[b"x" * LIMIT], [b"x" * (LIMIT - 1), b"x"], [b"x"] * LIMIT])
def test_a_body_has_at_most_so_many_bytes(pieces: list[bytes]) -> None:
    assert len(received(receiver_of(), request_of(pieces))[0]) == LIMIT
    with pytest.raises(BodyTooLargeError):
        received(receiver_of(), request_of([*pieces, b"x"]))


def test_bodies_are_held_until_their_block_ends() -> None:
    budget = ByteBudget(150, least_share=150)
    receiver = BodyReceiver(LIMIT, budget, 5.0)

    async def scenario() -> None:
        now = asyncio.get_running_loop().time()
        async with receiver.receiving(request_of([b"x" * 40, b"x" * 60]), now):
            assert budget.held == 100
            async with receiver.receiving(request_of([b"x" * 50]), now, b"other"):
                assert budget.held == 150
            for pieces in ([b"x" * 51], [b"x" * 50, b"x"]):
                with pytest.raises(TooMuchHeldError):
                    async with receiver.receiving(request_of(pieces), now, b"third"):
                        pytest.fail("held too much")
            assert budget.held == 100
        assert budget.held == 0

    asyncio.run(scenario())


def test_head_and_body_have_one_time_to_arrive() -> None:
    assert received(receiver_of(timeout=60.0), request_of([b"a", b"b"], pause=0.01), waited=30.0) == (b"ab", False)
    receiver = receiver_of(timeout=0.3)
    for request, waited in ((request_of([b"a", b"b"], pause=0.2), 0.0), (request_of([b"a"], pause=0.1), 0.29)):
        with pytest.raises(BodyTooSlowError, match=r"0\.3 s;"):
            received(receiver, request, waited)


def test_only_receiving_has_to_be_in_time() -> None:
    """What takes long once the body is there is no fault of the client, and what fails then is no late body."""
    receiver = receiver_of(timeout=1.0)

    async def work() -> AsyncIterator[None]:
        async with receiver.receiving(request_of([b"a"]), asyncio.get_running_loop().time()):
            await asyncio.sleep(1.1)
            raise TimeoutError
            yield

    async def scenario() -> None:
        with pytest.raises(TimeoutError):
            await anext(work())

    asyncio.run(scenario())


@pytest.mark.parametrize(
    ("headers", "gzipped"),
    [
        *(({"content_type": one}, False) for one in ("application/json", "APPLICATION/JSON; charset=utf-8")),
        *(({"content_type": one}, False) for one in ("application/geo+json", " application/json ")),
        *(({"content_encoding": one}, True) for one in ("gzip", "x-gzip", "GZIP", "identity, gzip")),
        *(({"content_encoding": one}, False) for one in ("", "identity", ", ")),
    ],
    ids=str,
)
def test_json_and_gzip_by_any_name(headers: dict[str, str], gzipped: bool) -> None:
    assert received(receiver_of(), request_of([b"{}"], **headers)) == (b"{}", gzipped)


@pytest.mark.parametrize(
    ("headers", "error"),
    [
        *(({"content_type": one}, MediaTypeError) for one in ("", "text/plain", "text/json", "application/xml")),
        *(({"content_type": one}, MediaTypeError) for one in ("text/x+json", "json")),
        *(({"content_encoding": one}, EncodingError) for one in ("br", "gzip, gzip", "deflate", "gzip, br")),
    ],
    ids=str,
)
def test_what_its_head_says_is_not_taken(headers: dict[str, str], error: type[Exception]) -> None:
    with pytest.raises(error):
        received(receiver_of(), request_of([b"{}"], **headers))


def answered(response: httpx.Response) -> dict[str, Any]:
    assert response.status_code == 200, response.text
    answer: dict[str, Any] = response.json()
    return {name: value for name, value in answer.items() if name not in ("request_id", "timing_ms")}


def test_packed_or_in_chunks_it_is_the_same_request(client: httpx.Client) -> None:
    body = orjson.dumps(examples.REGISTER)
    plain = answered(client.post("/v1/register", content=body))
    assert answered(client.post("/v1/register", content=gzip.compress(body, mtime=0), headers=PACKED)) == plain
    assert answered(client.post("/v1/register", content=iter([body[:10], body[10:]]))) == plain


@pytest.fixture(scope="module")
def narrow(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    """A service that takes small bodies only."""
    from tests.running import running

    with running(tmp_path_factory.mktemp("narrow"), max_body_bytes=20_000) as service:
        yield service


def padded(size: int) -> bytes:
    body = orjson.dumps(examples.REGISTER)
    return body + b" " * (size - len(body))


WAYS: dict[str, Callable[[bytes], dict[str, Any]]] = {
    "whole": lambda body: {"content": body},
    "chunked": lambda body: {"content": iter([body[:15_000], body[15_000:]])},
    "packed": lambda body: {"content": gzip.compress(body, mtime=0), "headers": PACKED},
}


@pytest.mark.parametrize("way", WAYS)
def test_the_limit_is_exact_whichever_way_a_body_comes(narrow: RunningService, way: str) -> None:
    for size, status in ((20_000, 200), (20_001, 413)):
        answer = narrow.client.post("/v1/register", **WAYS[way](padded(size)))
        assert answer.status_code == status, (size, answer.text)
        if status == 413:
            assert answer.json()["detail"] == "expected a body of at most 20000 bytes, unpacked; found more"


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

    response = narrow.client.post("/v1/associate", content=endless())
    assert response.status_code == 413
    assert sent < 20_000_000
