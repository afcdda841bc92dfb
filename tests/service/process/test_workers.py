"""Several workers: one port, one set of counts, one limit; the dead are replaced, and all end together."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import httpx
import orjson
import pytest

from linefix.documents import examples
from tests.running import RunningService, children_of, client_of, is_running, running, until
from tests.service.searches import searched_briefly, searched_for, store_hard_map

POSTS = 'linefix_http_requests_total{method="POST",route="/v1/associate",status="200"}'


def workers_of(service: RunningService) -> set[int]:
    return {
        pid
        for pid in children_of(service.process.pid)
        if is_running(pid) and b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()
    }


def anew(service: RunningService, method: str, path: str, body: bytes | None = None) -> httpx.Response:
    """Ask over a connection of its own: any worker may take it."""
    with client_of(service.url) as client:
        return client.request(method, path, content=body)


def ready(service: RunningService) -> int:
    return service.log().count('"ready"')


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningService]:
    """Two workers; tests may kill them, since they are replaced."""
    folder = tmp_path_factory.mktemp("pair")
    with running(folder, workers=2, searches=2, queue=4) as service:
        until(lambda: ready(service) == 2)
        yield service
        assert "a defect" not in service.log()
        assert "does not open" not in service.log()


def test_no_worker_takes_a_request_before_it_can_serve_it(tmp_path: Path) -> None:
    with running(tmp_path, workers=2, searches=2, queue=64) as service, ThreadPoolExecutor(8) as several:
        body, statuses = orjson.dumps(examples.ASSOCIATE), []
        while ready(service) < 2 or len(statuses) < 100:
            asked = [several.submit(anew, service, "POST", "/v1/associate", body) for _ in range(10)]
            statuses += [one.result().status_code for one in asked]
        assert set(statuses) == {200}


def test_counts_are_of_all_workers_and_never_go_down(pair: RunningService) -> None:
    before = pair.count(POSTS)
    for _ in range(40):
        assert anew(pair, "POST", "/v1/associate", orjson.dumps(examples.ASSOCIATE)).status_code == 200
    texts = [anew(pair, "GET", "/metrics").text for _ in range(10)]
    assert all(f"{POSTS} {before + 40}" in text for text in texts)
    # A worker that is killed takes none of its counts with it, but all that it had running.
    started = ready(pair)
    for pid in workers_of(pair):
        os.kill(pid, signal.SIGKILL)
    until(lambda: ready(pair) == started + 2)
    assert pair.count(POSTS) == before + 40
    until(lambda: pair.count("linefix_workers_ready") == 2.0)


def test_a_worker_that_dies_is_replaced_and_the_other_answers_meanwhile(pair: RunningService) -> None:
    before, started = workers_of(pair), ready(pair)
    assert len(before) == 2
    os.kill(min(before), signal.SIGKILL)
    statuses: list[int] = []

    def replaced() -> bool:
        with suppress(httpx.TransportError):
            statuses.append(anew(pair, "GET", "/readyz").status_code)
        return ready(pair) == started + 1

    until(replaced)
    assert (set(statuses), len(statuses) > 5) == ({200}, True)
    after = workers_of(pair)
    assert len(after) == 2
    assert len(after & before) == 1


def test_searches_and_queue_are_limited_over_all_workers(pair: RunningService) -> None:
    body, enough = searched_briefly(), threading.Event()
    statuses: list[int] = []

    def ask() -> None:
        while not enough.is_set():
            statuses.append(anew(pair, "POST", "/v1/associate", body).status_code)

    threads = [threading.Thread(target=ask) for _ in range(12)]
    for thread in threads:
        thread.start()
    try:
        until(lambda: {200, 503} <= set(statuses))
        found = [pair.counts("linefix_searches_running", "linefix_searches_waiting") for _ in range(15)]
    finally:
        enough.set()
        for thread in threads:
            thread.join()
    # Of each worker one slot and two places; a search that takes long gives its slot back and has one of the places.
    assert max(running + waiting for running, waiting in found) <= 6.0
    assert set(statuses) == {200, 503}


def test_all_drain_and_end_together(start_service: Callable[..., RunningService]) -> None:
    service = start_service(workers=2, searches=2)
    until(lambda: ready(service) == 2)
    answers: list[int] = []
    store_hard_map(service, workers=2)
    body = searched_for()

    def ask() -> None:
        answers.append(anew(service, "POST", "/v1/associate", body).status_code)

    busy = threading.Thread(target=ask)
    busy.start()
    until(lambda: service.count("linefix_searches_running") == 1.0)
    pids = workers_of(service)
    service.process.send_signal(signal.SIGTERM)
    assert service.ended() == 0
    busy.join()
    assert answers == [200]
    assert not any(is_running(pid) for pid in pids)
    assert "Traceback" not in service.log()
    with pytest.raises(httpx.ConnectError):
        anew(service, "GET", "/livez")
