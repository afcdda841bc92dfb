"""Connections that are held open, and answers that no one reads."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable
from contextlib import ExitStack

import httpx
import pytest

from tests.running import RunningService, until
from tests.service.parsing.bodies import large_map

LIVEZ = b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n"


def test_beyond_all_that_may_be_open_a_request_is_refused(start_service: Callable[..., RunningService]) -> None:
    running = start_service(max_connections=8, request_timeout_s=60.0)
    with ExitStack() as stack:
        connections = [stack.enter_context(running.connection()) for _ in range(20)]
        for connection in connections:
            connection.sendall(LIVEZ)
        statuses = [connection.recv(4096)[9:12] for connection in connections]
    assert {*statuses} <= {b"200", b"503"}
    assert statuses.count(b"503") >= 12
    until(lambda: running.client.get("/livez").status_code == 200)


def slow_readers(running: RunningService, count: int, path: str, stack: ExitStack) -> list[socket.socket]:
    """Return connections that have sent a request and read nothing yet."""
    readers = []
    for _ in range(count):
        connection = stack.enter_context(socket.socket())
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        connection.connect(("127.0.0.1", running.port))
        connection.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        readers.append(connection)
    return readers


@pytest.mark.long
def test_answers_that_nobody_reads_are_bounded(start_service: Callable[..., RunningService]) -> None:
    """Sixty readers of a map of 10 MB that took their time held 898 MB."""
    running = start_service(max_answers_bytes=30_000_000, max_body_bytes=12_000_000)
    body = large_map(110_000)
    assert running.client.put("/v1/maps/large", content=body).status_code == 201
    with ExitStack() as stack:
        with running.grows_by_less_than(120.0):
            readers = slow_readers(running, 60, "/v1/maps/large", stack)
            statuses = [connection.recv(12)[9:] for connection in readers]
        assert statuses.count(b"200") in (1, 2, 3)
        assert statuses.count(b"429") == 60 - statuses.count(b"200")
        # Another address still has its part, and a client that reads gets the whole answer.
        transport = httpx.HTTPTransport(local_address="127.0.0.2")
        with httpx.Client(base_url=running.url, transport=transport, timeout=30.0) as client:
            assert client.get("/v1/maps/large").content == body
    until(lambda: running.client.get("/v1/maps/large").status_code == 200)


@pytest.mark.long
def test_many_readers_of_the_pages_share_what_they_read(service: RunningService) -> None:
    """A script of 1.5 MB that everybody may request, without a key."""
    with ExitStack() as stack, service.grows_by_less_than(60.0):
        slow_readers(service, 150, "/docs/assets/swagger-ui-bundle.js", stack)
        time.sleep(2.0)
