"""Bodies: packed, chunked, too large, slow, withheld, of very many things; and a batch whose answers are too large."""

from __future__ import annotations

import gzip
import os
import random
import select
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, suppress
from http.client import HTTPConnection
from pathlib import Path
from typing import Any

import httpx
import orjson
import pytest

from linefix.documents import examples
from tests.running import PATIENCE, RunningService, children_of, client_of, is_running, until
from tests.service.parsing.bodies import large_map

PACKED = {"content-encoding": "gzip"}
LARGE = random.Random(0).randbytes(3 << 20)  # does not get smaller


def answered(response: httpx.Response) -> dict[str, Any]:
    assert response.status_code == 200, response.text
    return {name: value for name, value in response.json().items() if name not in ("request_id", "timing_ms")}


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
    "more bytes": (ONE + b"more", "more bytes follow"), "two objects": (ONE * 2, "more bytes follow"),
    "a large one, and more bytes": (gzip.compress(LARGE, 1) + b"x", "more bytes follow"),
    "many empty ones": (gzip.compress(b"") * 1_500_000, "more bytes follow"),
}  # fmt: skip


@pytest.mark.parametrize("kind", NOT_PACKED)
def test_what_is_no_object_as_gzip(client: httpx.Client, kind: str) -> None:
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
    sender = HTTPConnection("127.0.0.1", service.port)
    sender.request("POST", "/v1/associate", bytes(99_000_000))  # as many clients: all is sent before anything is read
    assert sender.getresponse().status == 413
    sender.close()


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
    assert (many.status_code, many.json()["code"], many.headers["retry-after"]) == (429, "rate_limited", "1")
    assert found() - before < 1.25 * room


ASSOCIATE = b"POST /v1/associate HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"


def withhold(running: RunningService, stack: ExitStack, count: int, size: int, head: bytes) -> list[socket.socket]:
    """Send bodies up to their last byte; return the connections, which stay open."""
    connections = []
    for _ in range(count):
        connection = stack.enter_context(socket.create_connection(("127.0.0.1", running.port), timeout=20))
        with suppress(ConnectionError):
            connection.sendall(head + b"Content-Length: %d\r\n\r\n" % size + b" " * (size - 1))
        connections.append(connection)
    return connections


def statuses_of(connections: list[socket.socket]) -> list[bytes]:
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
        until(lambda: statuses_of(withheld).count(b"429") >= 3)
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


@pytest.mark.parametrize(
    "body",
    [
        pytest.param(b" " * 16_000_000 + b"{}", id="refused where it is parsed"),
        pytest.param(
            b'{"map": ' + large_map(190_000).replace(b"[[-4.0,", b"[[-2e5,", 1) + b', "scan": {"segments": []}}',
            id="refused where it is indexed",
            marks=pytest.mark.long,
        ),
    ],
)
def test_refused_bodies_are_not_held(service: RunningService, body: bytes) -> None:
    assert service.client.post("/v1/associate", content=body).status_code == 422
    before = service.memory_mb()
    for _ in range(12):
        assert service.client.post("/v1/associate", content=body).status_code == 422
    assert service.memory_mb() - before < 100.0


def test_a_large_body_is_answered_like_a_small_one(client: httpx.Client) -> None:
    body = b'{"map": ' + large_map() + b', "scan": ' + orjson.dumps({"segments": examples.SEEN}) + b"}"
    for content, headers in ((body, {}), (gzip.compress(body, 1), {"content-encoding": "gzip"})):
        answer = client.post("/v1/associate", content=content, headers=headers)
        assert answer.status_code == 200, answer.text
        assert answer.json()["pose"]["x"] == pytest.approx(1.0, abs=1e-6)
    wrong = client.post("/v1/associate", content=body.replace(b"[[-4.0,", b'[["-4",', 1))
    assert wrong.status_code == 422
    assert wrong.json()["errors"] == [{"pointer": "/map/segments/0", "message": "expected a number, found a string"}]


def test_a_large_map_is_stored_and_found(client: httpx.Client) -> None:
    body = large_map()
    assert client.put("/v1/maps/large", content=body).status_code == 201
    assert client.get("/v1/maps/large").content == body
    answer = client.post("/v1/associate", json={"map": {"map_id": "large"}, "scan": {"segments": examples.SEEN}})
    assert answer.json()["pose"]["y"] == pytest.approx(0.5, abs=1e-6)
    client.delete("/v1/maps/large")


@pytest.mark.long
def test_a_service_with_large_bodies_keeps_nothing_of_them_and_takes_its_parser_along(
    start_service: Callable[..., RunningService],
) -> None:
    """Neither by a statement nor by its parameters: 15 MB each, and that for each connection."""
    running = start_service()
    pid = running.process.pid

    def resident() -> float:
        status = Path(f"/proc/{pid}/status").read_text()
        return next(int(line.split()[1]) / 1e3 for line in status.splitlines() if line.startswith("RssAnon"))

    body = large_map(150_000)
    before = resident()
    for _ in range(2):
        running.client.put("/v1/maps/m", content=body).raise_for_status()
    # On a busy machine the thread that stored the last one may still hold it when the answer has come.
    until(lambda: resident() - before < 0.75 * len(body) / 1e6)

    (first,) = children_of(pid)
    os.kill(first, signal.SIGKILL)
    statuses = [running.client.put("/v1/maps/m", content=large_map()).status_code for _ in range(2)]
    assert statuses in ([200, 200], [503, 200])
    (second,) = children_of(pid)
    assert second != first
    running.process.kill()
    running.process.wait()
    until(lambda: not is_running(second))
