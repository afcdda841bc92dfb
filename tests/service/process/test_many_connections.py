"""Connections that are held open, and answers that nobody reads."""

from __future__ import annotations

import resource
import socket
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing, suppress
from http.client import HTTPConnection

import httpx
import orjson
import pytest

from service.schemas import examples
from tests.running import RunningService, until
from tests.running import running as start_running
from tests.service.parsing.bodies import large_map
from tests.service.searches import searched_for, store_hard_map

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
            started = stack.enter_context(start_running(tmp_path_factory.mktemp("few")))
        finally:
            resource.setrlimit(resource.RLIMIT_NOFILE, before)
        yield started


def connect(running: RunningService, address: str = "127.0.0.1") -> socket.socket:
    return socket.create_connection(("127.0.0.1", running.port), timeout=10, source_address=(address, 0))


@pytest.mark.parametrize("kind", HELD)
def test_connections_that_are_held_keep_nobody_out(few_descriptors: RunningService, kind: str) -> None:
    """270 of them made `/readyz` 503, PUT read-only, and a PUT that needed the parser a 500."""
    running = few_descriptors
    with ExitStack() as stack:
        for _ in range(600):
            connection = stack.enter_context(connect(running))
            with suppress(ConnectionError):
                connection.sendall(HELD[kind])
        for address in ("127.0.0.1", "127.0.0.2"):
            transport = httpx.HTTPTransport(local_address=address)
            with httpx.Client(base_url=running.url, transport=transport, timeout=10.0) as client:
                assert client.get("/readyz").status_code == 200
                assert client.put("/v1/maps/m", json=examples.MAP).status_code in (200, 201)
                assert client.put("/v1/maps/l", content=large_map(), headers={"content-type": "application/json"})
                stored = {"map": {"map_id": "m"}, "scan": {"segments": examples.SEEN}}
                assert client.post("/v1/associate", json=stored).status_code == 200
    assert "a defect" not in running.log()


def test_an_address_keeps_its_connections_beside_another_s_flood(start_service: Callable[..., RunningService]) -> None:
    running = start_service(max_connections=20)
    with ExitStack() as stack:
        mine = stack.enter_context(connect(running, "127.0.0.2"))
        for _ in range(60):
            stack.enter_context(connect(running)).sendall(b"GET")
        mine.sendall(HELD["answered"])
        assert mine.recv(4096).startswith(b"HTTP/1.1 200")
        # Asked from that address: an idle connection of the other one is given up even as a request comes over it.
        mine.sendall(b"GET /metrics HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
        told = b"".join(iter(lambda: mine.recv(65536), b""))
        assert float(told.split(b"\nlinefix_connections ")[1].split()[0]) <= 10 + 1


def test_heads_that_do_not_end_take_no_connection_that_is_used(start_service: Callable[..., RunningService]) -> None:
    """Between two requests it was given up before them."""
    running = start_service(max_connections=20)
    with ExitStack() as stack:
        mine = stack.enter_context(closing(HTTPConnection("127.0.0.1", running.port, timeout=10)))
        mine.connect()
        mine.auto_open = False
        for _ in range(60):
            stack.enter_context(connect(running)).sendall(HELD["in their heads"])
            mine.request("GET", "/livez")
            assert mine.getresponse().read() == b'{"status":"ok"}'


def test_where_all_are_at_work_a_new_one_is_told_so(start_service: Callable[..., RunningService]) -> None:
    running = start_service(max_connections=8, queue=16, searches=1)
    store_hard_map(running)
    large, small = searched_for(30.0), orjson.dumps({**examples.ASSOCIATE, "options": {}})
    with ExitStack() as stack:
        transport = httpx.HTTPTransport(local_address="127.0.0.2")
        client = stack.enter_context(httpx.Client(base_url=running.url, transport=transport))
        # Half of the connections are one address's; and its own searches wait for one another.
        stack.enter_context(connect(running)).sendall(post(large))
        until(lambda: "linefix_searches_running 1.0" in client.get("/metrics").text)
        for _ in range(3):
            stack.enter_context(connect(running)).sendall(post(small))
        until(lambda: "linefix_searches_waiting 3.0" in client.get("/metrics").text)
        answer = stack.enter_context(connect(running)).recv(4096)
        assert answer.startswith(b"HTTP/1.1 503 ")
        assert b"too many connections" in answer


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
        # Another address has its share all the same, and whoever reads has it whole.
        transport = httpx.HTTPTransport(local_address="127.0.0.2")
        with httpx.Client(base_url=running.url, transport=transport, timeout=30.0) as client:
            assert client.get("/v1/maps/large").content == body
    until(lambda: running.client.get("/v1/maps/large").status_code == 200)


def test_many_readers_of_the_pages_share_what_they_read(service: RunningService) -> None:
    """A script of 1.5 MB that everybody may ask for, without a key."""
    before = service.memory_mb()
    with service.peak_mb() as peak, ExitStack() as stack:
        for _ in range(150):
            connection = stack.enter_context(socket.socket())
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            connection.connect(("127.0.0.1", service.port))
            connection.sendall(b"GET /docs/assets/swagger-ui-bundle.js HTTP/1.1\r\nHost: localhost\r\n\r\n")
        time.sleep(2.0)
        assert peak() - before < 60.0
