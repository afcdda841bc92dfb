"""Bodies: packed, chunked, too large, too slow."""

from __future__ import annotations

import gzip
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Any

import httpx
import orjson
import pytest

from service.process.listening import listen
from service.schemas import examples
from service.settings import Settings
from tests.conftest import RunningService, start, stop

Connect = Callable[[], AbstractContextManager[socket.socket]]
PACKED = {"content-encoding": "gzip"}


def answered(response: httpx.Response) -> dict[str, Any]:
    assert response.status_code == 200, response.text
    answer: dict[str, Any] = response.json()
    return {name: value for name, value in answer.items() if name not in ("request_id", "timing_ms")}


def test_gzip_is_the_same_request(client: httpx.Client) -> None:
    body = orjson.dumps(examples.REGISTER)
    plain = client.post("/v1/register", content=body)
    packed = client.post("/v1/register", content=gzip.compress(body), headers=PACKED)
    assert answered(packed) == answered(plain)


def test_chunked_is_the_same_request(client: httpx.Client) -> None:
    body = orjson.dumps(examples.REGISTER)
    pieces = client.post("/v1/register", content=iter([body[:10], body[10:]]))
    assert answered(pieces) == answered(client.post("/v1/register", content=body))


@pytest.mark.parametrize(
    "body", [b"not gzip", gzip.compress(b"{}")[:-4], gzip.compress(b"{}") + b"more", gzip.compress(b"{}") * 2, b""]
)
def test_what_is_not_gzip(client: httpx.Client, body: bytes) -> None:
    response = client.post("/v1/register", content=body, headers=PACKED)
    assert response.status_code == 400
    assert response.json()["code"] == "invalid_json"


def test_a_gzip_bomb_is_refused(client: httpx.Client) -> None:
    bomb = gzip.compress(b" " * 400_000_000, compresslevel=9)
    response = client.post("/v1/register", content=bomb, headers=PACKED)
    assert response.status_code == 413
    assert response.json()["code"] == "too_large"


def test_a_length_over_the_limit_is_refused_before_the_body_comes(connect: Connect) -> None:
    with connect() as connection:
        connection.sendall(b"POST /v1/associate HTTP/1.1\r\nHost: x\r\nContent-Length: 99000000\r\n\r\n")
        head = connection.recv(4096)
    assert head.startswith(b"HTTP/1.1 413 ")
    assert b"connection: close" in head.lower()


def test_chunks_over_the_limit_are_refused_while_they_come(client: httpx.Client) -> None:
    sent = 0

    def endless() -> Iterator[bytes]:
        nonlocal sent
        for _ in range(10_000):
            sent += 1_000_000
            yield b" " * 1_000_000

    response = client.post("/v1/associate", content=endless())
    assert response.status_code == 413
    assert sent < 200_000_000


def test_what_is_not_http_gets_a_problem(connect: Connect) -> None:
    with connect() as connection:
        connection.sendall(b"RUBBISH\r\n\r\n")
        answer = b"".join(iter(lambda: connection.recv(4096), b""))
    head, _, body = answer.partition(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 400 ")
    assert b"application/problem+json" in head
    assert orjson.loads(body)["code"] == "invalid_http"


@pytest.mark.parametrize(
    "head",
    [
        b"GET /\xff HTTP/1.1\r\nHost: x\r\n\r\n",
        b"CONNECT example.org:443 HTTP/1.1\r\nHost: x\r\n\r\n",
        b"POST /v1/associate HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\nContent-Length: 2\r\n\r\n",
        b"POST /v1/associate HTTP/1.1\r\nHost: x\r\nContent-Length: -1\r\n\r\n",
        b"POST /v1/associate HTTP/1.1\r\nContent-Length: 2\r\nTransfer-Encoding: chunked\r\n\r\n{}",
        b"GET / HTTP/1.1\r\nHost: x\r\nA: " + b"a" * 300_000,
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc",
    ],
)
def test_heads_that_are_none(connect: Connect, head: bytes, service: Any) -> None:
    with connect() as connection:
        connection.sendall(head)
        answer = b"".join(iter(lambda: connection.recv(4096), b""))
    assert answer.startswith(b"HTTP/1.1 400 ")
    assert orjson.loads(answer.partition(b"\r\n\r\n")[2])["code"] == "invalid_http"
    assert "Traceback" not in service.log()


def test_a_broken_chunk_ends_the_connection_and_nothing_else(connect: Connect, client: httpx.Client) -> None:
    with connect() as connection:
        connection.sendall(b"POST /v1/associate HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n")
        assert connection.recv(4096)[:12] in (b"HTTP/1.1 400", b"")
    assert client.get("/livez").status_code == 200


@pytest.fixture(scope="module")
def impatient(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    running = start(
        tmp_path_factory.mktemp("impatient"), drain_seconds=0, request_timeout=1.0, max_body_bytes=20_000_000
    )
    yield running
    stop(running)


def trickle(running: RunningService, pieces: list[bytes], pause: float) -> tuple[bytes, float]:
    """Send pieces with pauses until the service ends the connection; return its answer and how long it took."""
    begun = time.monotonic()
    answer = b""
    with socket.create_connection(("127.0.0.1", running.port), timeout=pause) as connection:
        for piece in pieces:
            with suppress(ConnectionError):
                connection.sendall(piece)
            with suppress(TimeoutError, ConnectionError):
                while part := connection.recv(4096):
                    answer += part
                break
    return answer, time.monotonic() - begun


HEAD = b"POST /v1/associate HTTP/1.1\r\nHost: x\r\nContent-Length: 5000\r\n"
SLOW = [
    ([b""] * 100, b""),
    ([b"\r\n"] * 100, b""),
    ([HEAD] + [b"X-A: a\r\n"] * 100, b""),
    ([HEAD + b"\r\n"] + [b" "] * 100, b"408"),
    # Slow in the head and in the body: one limit for both.
    ([HEAD] + [b"X-A: a\r\n"] * 7 + [b"\r\n"] + [b" "] * 100, b"408"),
    ([HEAD.replace(b"/v1/associate", b"/nothing") + b"\r\n"] + [b" "] * 100, b"404"),
    ([b"GET /livez HTTP/1.1\r\nHost: x\r\n\r\n", *[b"G"] * 100], b"200"),
]


@pytest.mark.parametrize(("pieces", "status"), SLOW)
def test_slow_clients_are_closed(impatient: RunningService, pieces: list[bytes], status: bytes) -> None:
    answer, seconds = trickle(impatient, pieces, 0.1)
    assert answer[9:12] == status
    # The limit is a second; with all the pieces it would be ten.
    assert seconds < 6.0


def test_who_does_not_read_the_answer_is_closed(impatient: RunningService) -> None:
    segments = [[float(i % 1000), 0.125, float(i % 1000) + 0.1234567890123, 0.1234567890123] for i in range(200_000)]
    assert impatient.client.put("/v1/maps/large", json={"segments": segments}).status_code == 201
    with socket.socket() as connection:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.connect(("127.0.0.1", impatient.port))
        connection.sendall(b"GET /v1/maps/large HTTP/1.1\r\nHost: x\r\n\r\n")
        connection.settimeout(20)
        time.sleep(4.0)
        received = 0
        with suppress(ConnectionError):
            while part := connection.recv(1 << 20):
                received += len(part)
    # What was on the way arrives, the rest was dropped with the connection.
    assert 0 < received < 6_000_000


def test_one_connection_carries_many_requests(connect: Connect) -> None:
    body = orjson.dumps(examples.REGISTER)
    request = b"POST /v1/register HTTP/1.1\r\nHost: x\r\nContent-Length: %d\r\n\r\n" % len(body) + body
    with connect() as connection:
        connection.sendall(3 * request)
        answers = b""
        while answers.count(b"HTTP/1.1 200") < 3 or not answers.endswith(b"}}"):
            answers += connection.recv(65536)
    assert answers.count(b'"status":"ok"') == 3


def test_no_part_of_an_answer_is_held_back(tmp_path: Path) -> None:
    with listen(Settings(port=0, data_dir=tmp_path)) as listener, socket.create_connection(listener.getsockname()):
        accepted, _ = listener.accept()
        with accepted:
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 9000
