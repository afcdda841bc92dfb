"""Several workers: one port, one set of counts, one limit; the dead are replaced, and all end together."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import httpx
import orjson
import pytest

from linefix.documents import examples
from tests.running import RunningService, asked_again, children_of, client_of, is_running, running, until
from tests.service.searches import searched_briefly

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
        body, statuses = orjson.dumps(examples.ASSOCIATE), []
        while ready(service) < 2 or len(statuses) < 50:
            statuses.append(anew(service, "POST", "/v1/associate", body).status_code)
        assert set(statuses) == {200}, "no worker takes a request before it can serve it"
        yield service
        log = service.log()
        assert [word for word in ("a defect", "does not open", "Traceback") if word in log] == []


def test_counts_are_of_all_workers(pair: RunningService) -> None:
    before = pair.count(POSTS)
    for _ in range(40):
        assert anew(pair, "POST", "/v1/associate", orjson.dumps(examples.ASSOCIATE)).status_code == 200
    texts = [anew(pair, "GET", "/metrics").text for _ in range(10)]
    assert all(f"{POSTS} {before + 40}" in text for text in texts)


def test_a_worker_that_dies_is_replaced_and_the_other_answers_meanwhile(pair: RunningService) -> None:
    before, started, counted = workers_of(pair), ready(pair), pair.count(POSTS)
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
    # It takes none of its counts with it, but all that it had running.
    assert pair.count(POSTS) == counted
    until(lambda: pair.count("linefix_workers_ready") == 2.0)


def test_searches_and_queue_are_limited_over_all_workers(pair: RunningService) -> None:
    body = searched_briefly()
    statuses: list[int] = []
    with asked_again(12, lambda: statuses.append(anew(pair, "POST", "/v1/associate", body).status_code)):
        until(lambda: {200, 503} <= set(statuses))
        found = [pair.counts("linefix_searches_running", "linefix_searches_waiting") for _ in range(15)]
    # Of each worker one slot and two places; a search that takes long gives its slot back and has one of the places.
    assert max(running + waiting for running, waiting in found) <= 6.0
    assert set(statuses) == {200, 503}


def test_without_the_file_of_its_maps_it_is_not_ready(pair: RunningService) -> None:
    """A new one was made, empty, and all was well."""
    path = pair.data_dir / "maps.sqlite3"
    pair.client.put("/v1/maps/m", json=examples.MAP).raise_for_status()
    path.rename(path.with_name("away"))
    until(lambda: anew(pair, "GET", "/readyz").status_code == 503)
    for method, body in (("GET", None), ("PUT", orjson.dumps(examples.MAP))):
        answer = anew(pair, method, "/v1/maps/m", body)
        assert (answer.status_code, answer.json()["code"]) == (503, "not_ready")
    assert anew(pair, "POST", "/v1/associate", orjson.dumps(examples.ASSOCIATE)).status_code == 200
    assert not path.exists()
    assert len(workers_of(pair)) == 2
    path.with_name("away").rename(path)
    assert anew(pair, "GET", "/v1/maps/m").json() == examples.MAP
    until(lambda: anew(pair, "GET", "/readyz").status_code == 200)


@pytest.mark.long
def test_what_a_first_start_compiles_is_not_kept_in_memory(
    start_service: Callable[..., RunningService], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LINEFIX_KERNELS", str(tmp_path / "kernels"))
    running = start_service(probe="/livez", workers=2, searches=2)
    begun = time.monotonic()
    until(lambda: ready(running) == 2, patience=300.0)
    assert time.monotonic() - begun > 5.0, "nothing was compiled"
    assert running.log().count("compiling the kernels") == 2
    for pid in workers_of(running):
        status = Path(f"/proc/{pid}/status").read_text()
        anonymous = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("RssAnon"))
        assert anonymous < 200_000  # kB; with the compiler in it, 480,000
