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
