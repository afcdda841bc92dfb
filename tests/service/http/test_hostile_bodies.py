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

    with running.grows_by_less_than(150.0), ThreadPoolExecutor(12) as threads:
        # Which of those that unpack side by side are refused, one or all, is a matter of luck.
        for _ in range(10):
            statuses |= {asked.result() for asked in [threads.submit(ask) for _ in range(12)]}
            if 429 in statuses:
                break
    assert 429 in statuses
    assert statuses <= {422, 429}
    # Alone there is room.
    assert running.client.post("/v1/associate", content=packed, headers=PACKED).status_code == 422


ASKED = b'{"map": {"map_id": "m"}, "scan": {"segments": []%b}, %b}'
ARRAYS, FIELDS = b",".join([b"[]"] * 120_000), b",".join(b'"%x":1' % number for number in range(50_000))
WIDE = {
    "include": ASKED % (b"", b'"options": {"include": [%b]}' % b",".join([b'"a"'] * 120_000)),
    "unknown fields of a map": b'{"scan": {"segments": []}, "map": {"segments": [], %b}}' % FIELDS,
    "unknown fields": b"{%b}" % FIELDS,
    "a viewpoint": ASKED % (b', "viewpoint": [%b]' % ARRAYS, b'"client_ref": 1'),
    "a covariance": ASKED % (b"", b'"prior": {"x":0,"y":0,"theta":0,"covariance": [%b]}' % ARRAYS),
    "a stamp": ASKED % (b', "stamp": [%b]' % ARRAYS, b'"client_ref": 1'),
}
# 1.9 million took 2.7 GB in the parser.
WIDER = {
    "include": b'{"options": {"include": [%b]}}' % b",".join([b'"a"'] * 900_000),
    "unknown fields": b"{%b}" % b",".join(b'"%x":1' % number for number in range(900_000)),
}


@pytest.mark.parametrize(
    ("body", "most_mb"),
    [
        *(pytest.param(body, 25.0, id=kind) for kind, body in WIDE.items()),
        *(pytest.param(body, 250.0, id=f"{kind}, parsed", marks=pytest.mark.long) for kind, body in WIDER.items()),
    ],
)
def test_many_wrong_things_cost_no_more_than_a_few(service: RunningService, body: bytes, most_mb: float) -> None:
    few = b'{"options": {"include": ["a"]}}' + b" " * min(len(body), 2_000_000)
    assert service.client.post("/v1/associate", content=few).status_code == 422  # the parser takes 40 MB for its first
    with service.grows_by_less_than(most_mb):
        answer = service.client.post("/v1/associate", content=body)
        assert answer.status_code in (413, 422)
        assert len(answer.content) < 8192
