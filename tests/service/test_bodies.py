"""Bodies: packed, chunked, too large, too slow."""

from __future__ import annotations

import gzip
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from typing import Any

import httpx
import orjson
import pytest

from service.schemas import examples

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


def test_a_broken_chunk_ends_the_connection_and_nothing_else(connect: Connect, client: httpx.Client) -> None:
    with connect() as connection:
        connection.sendall(b"POST /v1/associate HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\nzz\r\n")
        assert connection.recv(4096)[:12] in (b"HTTP/1.1 400", b"")
    assert client.get("/livez").status_code == 200


@pytest.mark.parametrize(
    ("sent", "status"),
    [(b"POST /v1/associate HTTP/1.1\r\nHost: x\r\nContent-Length: 50\r\n\r\n{", b"408"), (b"POST /v1", b"")],
)
def test_slow_clients_are_closed(start_service: Callable[..., Any], sent: bytes, status: bytes) -> None:
    running = start_service(body_timeout=0.5, head_timeout=0.5)
    begun = time.monotonic()
    with socket.create_connection(("127.0.0.1", running.port), timeout=20.0) as connection:
        connection.sendall(sent)
        answer = b"".join(iter(lambda: connection.recv(4096), b""))
    assert time.monotonic() - begun < 10.0
    assert answer[9:12] == status
