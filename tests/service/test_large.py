"""Large bodies: parsed by a process of its own, with the same answers, and bounded in what they may take."""

from __future__ import annotations

import gzip
import os
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import orjson
import pytest

from service.http.problems import ProblemError
from service.maps.lookup import LARGE
from service.parsing.channel import Channel
from service.parsing.parser_process import ParserProcess
from service.parsing.reading import read_map, read_model
from service.schemas import examples
from service.schemas.requests import MapDocument
from service.schemas.strict import TooLargeError

LIMITS = {"values": 2_000_000, "map_segments": 200_000}


@pytest.fixture(scope="module")
def parser() -> Iterator[ParserProcess]:
    made = ParserProcess()
    yield made
    made.close()


def large_map(count: int = 20_000) -> bytes:
    """A room, and far away many short walls."""
    begins = np.random.default_rng(0).uniform(1e3, 2e3, (count, 2))
    segments = np.vstack([examples.WALLS, np.hstack([begins, begins + np.array([1.0, 0.1])])])
    body = orjson.dumps({"segments": segments}, option=orjson.OPT_SERIALIZE_NUMPY)
    assert len(body) > LARGE
    return body


def children_of(pid: int) -> set[int]:
    return {int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()} | {
        int(child) for task in Path(f"/proc/{pid}/task").iterdir() for child in (task / "children").read_text().split()
    }


def is_running(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


def test_the_other_process_reads_as_this_one_does(parser: ParserProcess) -> None:
    body = large_map()
    there, here = parser.call(read_map, body, LIMITS), read_map(body, LIMITS)
    assert parser.pid not in (None, os.getpid())
    assert np.array_equal(there[0].segments, here[0].segments)
    assert there[1] == here[1]


def test_problems_cross_whole(parser: ParserProcess) -> None:
    with pytest.raises(ProblemError) as caught:
        parser.call(read_model, MapDocument, b'{"segments": [[0, 0, 1]]}', LIMITS)
    assert [(fault.pointer, fault.message) for fault in caught.value.faults] == [
        ("/segments/0", "expected 4 numbers, got 3")
    ]
    with pytest.raises(TooLargeError) as size:
        parser.call(read_model, MapDocument, b'{"segments": [1, 2, 3]}', {**LIMITS, "map_segments": 2})
    assert size.value.detail == "at most 2 map segments are taken"
    with pytest.raises(ProblemError) as header:
        parser.call(_raise, ProblemError("too_large", "no", headers={"Connection": "close"}))
    assert header.value.headers == {"Connection": "close"}


def _raise(error: Exception) -> None:
    raise error


def test_objects_cross_a_channel_and_the_end_of_the_other_side_is_told() -> None:
    one, other = map(Channel, socket.socketpair())
    sent = (b"x" * 3_000_000, bytearray(b"y"), np.arange(400_000.0).reshape(-1, 4), {"a": b"z"}, b"")
    thread = threading.Thread(target=one.send, args=(sent,))
    thread.start()
    come = other.receive()
    thread.join()
    assert np.array_equal(come[2], sent[2])
    assert come[:2] + come[3:] == sent[:2] + sent[3:]
    one.close()
    with pytest.raises(EOFError):
        other.receive()
    with pytest.raises(BrokenPipeError):
        other.send((1,))
    other.close()


def test_an_end_of_the_process_is_one_refusal(parser: ParserProcess) -> None:
    before = parser.call(os.getpid)
    with pytest.raises(ProblemError) as caught:
        parser.call(os._exit, 1)
    assert caught.value.code == "overloaded"
    after = parser.call(os.getpid)
    assert after != before
    os.kill(after, signal.SIGKILL)
    # Found dead before the next call, or in it: then that is the one refusal.
    try:
        assert parser.call(os.getpid) != after
    except ProblemError:
        assert parser.call(os.getpid) != after


def test_too_many_values_are_refused_before_they_take_memory(parser: ParserProcess) -> None:
    for body in (b"[" + b"[]," * 1_000_000, b"{" + b'"a":1,' * 1_000_001, b"[" + b"1," * 2_000_000):
        with pytest.raises(TooLargeError) as caught:
            parser.call(read_model, MapDocument, body, LIMITS)
        assert caught.value.detail == "at most 2000000 values are taken"


def test_a_large_body_is_answered_like_a_small_one(client: httpx.Client) -> None:
    body = b'{"map": ' + large_map() + b', "scan": ' + orjson.dumps({"segments": examples.SEEN}) + b"}"
    for content, headers in ((body, {}), (gzip.compress(body), {"content-encoding": "gzip"})):
        answer = client.post("/v1/associate", content=content, headers=headers)
        assert answer.status_code == 200, answer.text
        assert answer.json()["pose"]["x"] == pytest.approx(1.0, abs=1e-6)
    wrong = client.post("/v1/associate", content=body.replace(b"[[-4.0,", b'[["-4",', 1))
    assert wrong.status_code == 422
    assert wrong.json()["errors"] == [{"pointer": "/map/segments/0", "message": "expected a number"}]


def test_a_large_map_is_stored_and_found(client: httpx.Client) -> None:
    body = large_map()
    assert client.put("/v1/maps/large", content=body).status_code == 201
    assert client.get("/v1/maps/large").content == body
    answer = client.post("/v1/associate", json={"map": {"map_id": "large"}, "scan": {"segments": examples.SEEN}})
    assert answer.json()["pose"]["y"] == pytest.approx(0.5, abs=1e-6)
    client.delete("/v1/maps/large")


def test_nothing_is_kept_of_a_map_that_was_stored(start_service: Callable[..., Any]) -> None:
    """Neither by a statement nor by its parameters: 15 MB each, and that for each connection."""
    running = start_service()

    def resident() -> float:
        status = Path(f"/proc/{running.process.pid}/status").read_text()
        return next(int(line.split()[1]) / 1e3 for line in status.splitlines() if line.startswith("RssAnon"))

    body = large_map(150_000)
    before = resident()
    for _ in range(2):
        running.client.put("/v1/maps/m", content=body).raise_for_status()
    assert resident() - before < 0.75 * len(body) / 1e6


def test_many_values_over_http_are_413(client: httpx.Client) -> None:
    limit = client.get("/v1/limits").json()["max_values"]
    answer = client.post("/v1/associate", content=b'{"a": [' + b"[]," * (limit // 2 + 1) + b"[]]}")
    assert (answer.status_code, answer.json()["code"]) == (413, "too_large")


def test_the_parser_ends_with_the_service_and_is_replaced_when_it_dies(start_service: Callable[..., Any]) -> None:
    running = start_service()

    (first,) = children_of(running.process.pid)
    os.kill(first, signal.SIGKILL)
    statuses = [running.client.put("/v1/maps/m", content=large_map()).status_code for _ in range(2)]
    assert statuses in ([201, 200], [503, 201])
    (second,) = children_of(running.process.pid)
    assert second != first
    running.process.kill()
    running.process.wait()
    give_up = time.monotonic() + 10
    while is_running(second) and time.monotonic() < give_up:
        time.sleep(0.02)
    assert not is_running(second)
