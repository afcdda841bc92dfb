"""Bodies that another process parses, over HTTP."""

from __future__ import annotations

import gzip
import os
import signal
from collections.abc import Callable
from pathlib import Path

import httpx
import orjson
import pytest

from linefix.documents import examples
from tests.running import RunningService, children_of, is_running, until
from tests.service.parsing.bodies import large_map
from tests.service.searches import POST, searching, slow_to_index, store_hard_map


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


def test_no_large_body_waits_for_a_search(start_service: Callable[..., RunningService]) -> None:
    """Nor a middling one, or a packed one."""
    running = start_service(searches=1, queue=1)
    store_hard_map(running)
    with searching(running):
        for count in (1_000, 20_000):
            for packed in (False, True):
                body = large_map(count, least=0)
                headers = {"content-encoding": "gzip"} if packed else {}
                content = gzip.compress(body, 1) if packed else body
                running.client.put("/v1/maps/large", content=content, headers=headers).raise_for_status()


def test_no_search_waits_for_a_large_map_to_be_indexed(start_service: Callable[..., RunningService]) -> None:
    """A search can rest for another, what indexes a map cannot."""
    running = start_service(searches=1, queue=4)
    seen = b', "scan": ' + orjson.dumps({"segments": examples.SEEN}) + b"}"
    large = b'{"map": ' + slow_to_index(60_000) + seen[:-1] + b', "options": {"oriented": false, "deadline_ms": 30000}}'
    with running.connection(timeout=60.0) as connection:
        connection.sendall(POST + b"Content-Length: %d\r\n\r\n" % len(large) + large)
        until(lambda: running.count("linefix_indexing_running") == 1.0)
        running.client.post("/v1/associate", json=examples.ASSOCIATE).raise_for_status()
        assert running.count("linefix_indexing_running") == 1.0
        assert b" 200 OK" in connection.recv(12 + 4)


def test_many_values_over_http_are_413(client: httpx.Client) -> None:
    limit = client.get("/v1/limits").json()["max_values"]
    answer = client.post("/v1/associate", content=b'{"a": [' + b"[]," * (limit // 2 + 1) + b"[]]}")
    assert (answer.status_code, answer.json()["code"]) == (413, "too_large")


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
