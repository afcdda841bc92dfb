"""Connections that are held open, and answers that no one reads."""

from __future__ import annotations

import resource
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress

import httpx
import pytest

from service.schemas import examples
from tests.running import JSON, RunningService, client_of, until
from tests.running import running as start_running
from tests.service.parsing.bodies import large_map

HEAD = b"POST /v1/associate HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
HELD = {
    "that say nothing": b"",
    "in their heads": b"GET /livez HTTP/1.1\r\nHost: loc",
    "in their bodies": HEAD + b"Content-Length: 100\r\n\r\n{",
    "answered": b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n",
}


def post(body: bytes) -> bytes:
    return HEAD + b"Content-Length: %d\r\n\r\n" % len(body) + body


@pytest.fixture(scope="module")
def few_descriptors(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    with ExitStack() as stack:
        resource.setrlimit(resource.RLIMIT_NOFILE, (256, before[1]))
        try:
            started = stack.enter_context(start_running(tmp_path_factory.mktemp("few"), request_timeout_s=3.0))
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, before)
        yield started


def connect(running: RunningService, address: str = "127.0.0.1") -> socket.socket:
    return socket.create_connection(("127.0.0.1", running.port), timeout=10, source_address=(address, 0))


@pytest.mark.parametrize("kind", HELD)
def test_connections_that_are_held_end_in_time(few_descriptors: RunningService, kind: str) -> None:
    """270 of them made `/readyz` 503, PUT read-only, and a PUT that needed the parser a 500."""
    running = few_descriptors
    with ExitStack() as stack:
        for _ in range(400):
            connection = stack.enter_context(connect(running))
            with suppress(ConnectionError):
                connection.sendall(HELD[kind])
        with client_of(running.url) as client:
            assert client.get("/readyz").status_code == 200
            assert client.put("/v1/maps/m", json=examples.MAP).status_code in (200, 201)
            assert client.put("/v1/maps/l", content=large_map(), headers=JSON).status_code in (200, 201)
            stored = {"map": {"map_id": "m"}, "scan": {"segments": examples.SEEN}}
            assert client.post("/v1/associate", json=stored).status_code == 200
    assert "a defect" not in running.log()


def test_beyond_all_that_may_be_open_a_connection_waits(start_service: Callable[..., RunningService]) -> None:
    running = start_service(max_connections=8, request_timeout_s=60.0)
    running.client.get("/livez")  # keeps a connection
    held = [connect(running) for _ in range(7)]
    try:
        for connection in held:
            connection.sendall(HELD["answered"])
            assert connection.recv(4096).startswith(b"HTTP/1.1 200")
        with connect(running) as another:
            another.sendall(HELD["answered"])
            another.settimeout(0.5)
            with pytest.raises(TimeoutError):
                another.recv(4096)
            held.pop().close()
            another.settimeout(30.0)
            assert another.recv(4096).startswith(b"HTTP/1.1 200")
    finally:
        for connection in held:
            connection.close()


def test_answers_that_nobody_reads_are_bounded(start_service: Callable[..., RunningService]) -> None:
    """Sixty readers of a map of 10 MB that took their time held 898 MB."""
    running = start_service(max_answers_bytes=30_000_000, max_body_bytes=12_000_000)
    body = large_map(110_000)
    assert running.client.put("/v1/maps/large", content=body).status_code == 201
    before = running.memory_mb()
    with running.peak_mb() as peak, ExitStack() as stack:
        readers = []
        for _ in range(60):
            connection = stack.enter_context(socket.socket())
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            connection.connect(("127.0.0.1", running.port))
            connection.sendall(b"GET /v1/maps/large HTTP/1.1\r\nHost: localhost\r\n\r\n")
            readers.append(connection)
        statuses = [connection.recv(12)[9:] for connection in readers]
        assert peak() - before < 120.0
        assert statuses.count(b"200") in (1, 2, 3)
        assert statuses.count(b"429") == 60 - statuses.count(b"200")
        # Another address still has its part, and a client that reads gets the whole answer.
        transport = httpx.HTTPTransport(local_address="127.0.0.2")
        with httpx.Client(base_url=running.url, transport=transport, timeout=30.0) as client:
            assert client.get("/v1/maps/large").content == body
    until(lambda: running.client.get("/v1/maps/large").status_code == 200)


def test_many_readers_of_the_pages_share_what_they_read(service: RunningService) -> None:
    """A script of 1.5 MB that everybody may request, without a key."""
    before = service.memory_mb()
    with service.peak_mb() as peak, ExitStack() as stack:
        for _ in range(150):
            connection = stack.enter_context(socket.socket())
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            connection.connect(("127.0.0.1", service.port))
            connection.sendall(b"GET /docs/assets/swagger-ui-bundle.js HTTP/1.1\r\nHost: localhost\r\n\r\n")
        time.sleep(2.0)
        assert peak() - before < 60.0
