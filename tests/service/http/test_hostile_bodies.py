"""Bodies that are to take memory: packed, withheld, and of very many small things."""

from __future__ import annotations

import gzip
import select
import socket
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress

import orjson
import pytest

from linefix.documents import examples
from tests.running import PATIENCE, RunningService, client_of, until
from tests.service.parsing.bodies import large_map

ASSOCIATE = b"POST /v1/associate HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
PACKED = {"content-encoding": "gzip"}


def withhold(running: RunningService, stack: ExitStack, count: int, size: int, head: bytes) -> list[socket.socket]:
    """Send bodies up to their last byte; return the connections, which stay open."""
    connections = []
    for _ in range(count):
        connection = stack.enter_context(socket.create_connection(("127.0.0.1", running.port), timeout=20))
        with suppress(ConnectionError):
            connection.sendall(head + b"Content-Length: %d\r\n\r\n" % size + b" " * (size - 1))
        connections.append(connection)
    return connections


def answered(connections: list[socket.socket]) -> list[bytes]:
    """Return the statuses of those that have an answer by now."""
    ready, _, _ = select.select(connections, [], [], 0.0)
    found = []
    for connection in ready:
        with suppress(ConnectionError):
            found.append(connection.recv(12, socket.MSG_PEEK)[9:])
    return found


def test_a_key_that_withholds_leaves_the_others_room(start_service: Callable[..., RunningService]) -> None:
    """One key shut another out for nearly as long as a request may take."""
    running = start_service(keys="evil,robot", max_bodies_bytes=4_000_000, max_body_bytes=1_000_000)
    with ExitStack() as stack:
        withheld = withhold(running, stack, 6, 900_000, ASSOCIATE + b"Authorization: Bearer evil\r\n")
        until(lambda: answered(withheld).count(b"429") >= 3)
        headers = {"authorization": "Bearer robot"}
        body = orjson.dumps({**examples.ASSOCIATE, "options": {}}) + b" " * 900_000
        for _ in range(3):
            assert running.client.post("/v1/associate", content=body, headers=headers).status_code == 200
    until(lambda: running.count("linefix_bodies_bytes") == 0.0)


@pytest.mark.long
def test_packed_bodies_count_as_what_they_unpack_to(start_service: Callable[..., RunningService]) -> None:
    """1.9 MB sent were 1.17 GB held."""
    running = start_service(searches=1, max_bodies_bytes=40_000_000, max_body_bytes=20_000_000)
    packed = gzip.compress(b'{"map": ' + b" " * 19_000_000 + b"1}", 9)
    statuses: set[int] = set()
    together = threading.Barrier(12)

    def ask() -> int:
        with client_of(running.url, **PACKED) as client:
            together.wait(PATIENCE)
            return client.post("/v1/associate", content=packed).status_code

    before = running.memory_mb()
    with running.peak_mb() as peak, ThreadPoolExecutor(12) as threads:
        # Which of those that unpack side by side are refused, one or all, is a matter of luck.
        for _ in range(10):
            statuses |= {asked.result() for asked in [threads.submit(ask) for _ in range(12)]}
            if 429 in statuses:
                break
        assert peak() - before < 150.0
    assert 429 in statuses
    assert statuses <= {422, 429}
    # Alone there is room.
    assert running.client.post("/v1/associate", content=packed, headers=PACKED).status_code == 422


MANY = 480_000 // 4
WIDE = {
    "include": b'{"map": {"map_id": "m"}, "scan": {"segments": []}, "options": {"include": [%b]}}'
    % b",".join([b'"a"'] * MANY),
    "unknown fields of a map": b'{"scan": {"segments": []}, "map": {"segments": [], %b}}'
    % b",".join(b'"%x":1' % number for number in range(50_000)),
    "unknown fields": b"{%b}" % b",".join(b'"%x":1' % number for number in range(50_000)),
    "a viewpoint": b'{"map": {"map_id": "m"}, "scan": {"segments": [], "viewpoint": [%b]}}' % b",".join([b"[]"] * MANY),
    "a covariance": b'{"map": {"map_id": "m"}, "scan": {"segments": []}, "prior": {"x":0,"y":0,"theta":0,'
    b'"covariance": [%b]}}' % b",".join([b"[]"] * MANY),
    "a stamp": b'{"map": {"map_id": "m"}, "scan": {"segments": [], "stamp": [%b]}}' % b",".join([b"[]"] * MANY),
}


@pytest.mark.parametrize("kind", WIDE)
def test_many_wrong_things_cost_no_more_than_a_few(service: RunningService, kind: str) -> None:
    few = b'{"options": {"include": ["a"]}}' + b" " * len(WIDE[kind])  # the parser takes 40 MB once it has had a body
    assert service.client.post("/v1/associate", content=few).status_code == 422
    before = service.memory_mb()
    with service.peak_mb() as peak:
        answer = service.client.post("/v1/associate", content=WIDE[kind])
        assert answer.status_code in (413, 422)
        assert len(answer.content) < 8192
        assert peak() - before < 25.0


@pytest.mark.long
@pytest.mark.parametrize("kind", ["include", "unknown fields"])
def test_nor_in_the_parser(service: RunningService, kind: str) -> None:
    """1.9 million took 2.7 GB there."""
    item = b'"a"' if kind == "include" else b'"%x":1'
    items = b",".join([item] * 900_000) if kind == "include" else b",".join(item % n for n in range(900_000))
    body = b'{"options": {"include": [%b]}}' % items if kind == "include" else b"{%b}" % items
    service.client.put("/v1/maps/parsed", content=large_map(10_000)).raise_for_status()
    before = service.memory_mb()
    with service.peak_mb() as peak:
        answer = service.client.post("/v1/associate", content=body)
        assert answer.status_code in (413, 422)
        assert peak() - before < 250.0
