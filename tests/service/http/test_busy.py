"""A service with one slot for searches and one place to wait, both of which are taken."""

from __future__ import annotations

import gzip
import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import orjson
import pytest

from linefix.documents import examples
from service.http.middleware import LATER
from tests.running import RunningService, children_of, client_of, running, until
from tests.service.importing.forms import TYPE, form
from tests.service.parsing.bodies import large_map
from tests.service.searches import POST, post, searched_briefly, searched_for, searching, slow_to_index, store_hard_map

RUNNING, WAITING = "linefix_searches_running", "linefix_searches_waiting"


@pytest.fixture(scope="module")
def busy(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    with running(tmp_path_factory.mktemp("busy"), searches=1, queue=1, max_deadline_ms=600_000) as service:
        store_hard_map(service)
        yield service
        log = service.log()
        assert "a defect" not in log
        assert "Exception" not in log


@pytest.fixture(autouse=True)
def _at_rest(busy: RunningService) -> Iterator[None]:
    yield
    until(lambda: busy.counts(RUNNING, WAITING) == (0.0, 0.0))


@contextmanager
def full(busy: RunningService, source: str = "127.0.0.1") -> Iterator[None]:
    """Have two long searches: the second waits, or runs while the first goes on behind it, if another asks for it."""
    taken = (1.0, 1.0) if source == "127.0.0.1" else (2.0, 0.0)
    with searching(busy), busy.connection(source=source) as another:
        another.sendall(post(searched_for(30.0)))
        until(lambda: busy.counts(RUNNING, WAITING) == taken)
        yield


def test_too_many_are_told_to_come_back_before_they_send(busy: RunningService) -> None:
    head = b"POST /v1/register HTTP/1.1\r\nHost: localhost\r\nContent-Length: %d\r\n\r\n"
    counted = 'linefix_http_requests_total{method="POST",route="/v1/register",status="503"}'
    before = busy.count(counted)
    with full(busy):
        answer = busy.talk(head % 1000)
        assert answer.startswith(b"HTTP/1.1 503")
        assert b"retry-after: 1\r\n" in answer
        assert b'"code":"overloaded"' in answer
        # A request without a search is answered all the same, also on a connection that was refused before.
        livez = b"GET /livez HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"
        answer = busy.talk((head % 2 + b"{}") * 3 + livez)
        assert (answer.count(b"HTTP/1.1 503"), answer.endswith(b'{"status":"ok"}')) == (3, True)
        assert busy.client.get("/readyz").status_code == 200
        assert busy.client.put("/v1/maps/m", json=examples.MAP).is_success
    until(lambda: busy.count(RUNNING) == 0.0)
    assert busy.client.post("/v1/associate", json=examples.ASSOCIATE).status_code == 200
    until(lambda: busy.count(counted) == before + 4.0)


def test_a_client_that_hangs_up_frees_its_place(busy: RunningService) -> None:
    with searching(busy):
        with busy.connection() as connection:
            connection.sendall(post(searched_for(30.0)))
            until(lambda: busy.counts(RUNNING, WAITING) == (1.0, 1.0))
        # The one before it still runs: the place came free because its client left, long before its deadline.
        until(lambda: busy.counts(RUNNING, WAITING) == (1.0, 0.0), patience=20.0)


def test_a_key_that_keeps_others_waiting_is_told_so_a_little_later(busy: RunningService) -> None:
    """If it were told at once, it would send the next request at once."""
    asked = post(searched_briefly())
    with full(busy, "127.0.0.2"):
        begun = time.monotonic()
        assert busy.client.post("/v1/associate", content=searched_briefly()).status_code == 429
        assert time.monotonic() - begun >= LATER
        for _ in range(10):
            with busy.connection() as connection:
                connection.sendall(asked)
        with busy.connection() as connection:
            connection.sendall(asked)
            assert connection.recv(65_536).startswith(b"HTTP/1.1 429 ")
        assert busy.talk(POST + b"Transfer-Encoding: chunked\r\n\r\nno number\r\n").count(b"HTTP/1.1 ") == 1


def test_no_large_body_waits_for_a_search(busy: RunningService) -> None:
    """Nor a middling one, or a packed one."""
    with searching(busy):
        for count in (1_000, 20_000):
            body = large_map(count, least=0)
            busy.client.put("/v1/maps/large", content=body).raise_for_status()
            packed = {"content-encoding": "gzip"}
            busy.client.put("/v1/maps/large", content=gzip.compress(body, 1), headers=packed).raise_for_status()


@pytest.mark.long
def test_no_search_waits_for_a_large_map_to_be_indexed(busy: RunningService) -> None:
    """A search can rest for another, what indexes a map cannot."""
    seen = b', "scan": ' + orjson.dumps({"segments": examples.SEEN}) + b"}"
    large = b'{"map": ' + slow_to_index(60_000) + seen[:-1] + b', "options": {"oriented": false}}'
    with busy.connection(timeout=60.0) as connection:
        connection.sendall(post(large))
        until(lambda: busy.count("linefix_indexing_running") == 1.0)
        busy.client.post("/v1/associate", json=examples.ASSOCIATE).raise_for_status()
        assert busy.count("linefix_indexing_running") == 1.0
        assert b" 200 OK" in connection.recv(12 + 4)


def test_reading_files_takes_no_place_of_a_search(busy: RunningService) -> None:
    """Class of attack: one key's long work in the only place. Others searched in what it left, 4 % of the time."""
    curves = b'<svg xmlns="http://www.w3.org/2000/svg"><path d="M0 0' + b" C1 1 2 2 3 3" * 200_000 + b'"/></svg>'
    before = children_of(busy.process.pid)
    body = bytes(form({"a.svg": curves}))
    sent = {"content": body, "headers": {"content-type": TYPE}}
    importing = threading.Thread(target=busy.client.post, args=("/v1/maps:import",), kwargs=sent)
    importing.start()
    with client_of(busy.url) as client:
        until(lambda: len(children_of(busy.process.pid) - before) > 0)
        assert busy.count(RUNNING) == 0
        assert client.post("/v1/associate", json=examples.ASSOCIATE).status_code == 200
        for child in children_of(busy.process.pid) - before:
            os.kill(child, signal.SIGKILL)
    importing.join()
