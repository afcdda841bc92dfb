"""Several workers: one port, one set of counts, one limit; the dead are replaced, and all end together."""

from __future__ import annotations

import os
import re
import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import httpx
import pytest
from service.process.part import Part

from service.schemas import examples
from service.settings import SettingsError, read_settings
from service.telemetry.metrics import Metrics
from tests.conftest import RunningService
from tests.service.test_fairness import searched_for_a_while
from tests.service.test_large import children_of, is_running
from tests.service.test_process import heavy_body


def workers_of(running: RunningService) -> set[int]:
    return {
        pid
        for pid in children_of(running.process.pid)
        if is_running(pid) and b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()
    }


def metric(running: RunningService, line: str) -> float:
    text = running.client.get("/metrics").text
    found = re.search(rf"^{re.escape(line)} (\S+)$", text, re.MULTILINE)
    return float(found[1]) if found else 0.0


def until(condition: Callable[[], bool]) -> None:
    give_up = time.monotonic() + 120
    while not condition():
        assert time.monotonic() < give_up, "did not come about"
        time.sleep(0.02)


@pytest.fixture
def pair(start_service: Callable[..., RunningService]) -> RunningService:
    running = start_service(workers=2, searches=2, queue=4)
    until(lambda: running.log().count('"ready"') == 2)
    return running


def test_shares_add_up() -> None:
    for whole in (0, 1, 7, 16, 128_000_000):
        for of in (1, 2, 3, 5):
            shares = [Part(index, of).share(whole) for index in range(of)]
            assert sum(shares) == whole
            assert max(shares) - min(shares) <= 1


def test_no_more_workers_than_searches() -> None:
    with pytest.raises(SettingsError, match="workers"):
        read_settings(["--workers", "3", "--searches", "2"])


def test_counts_are_of_all_workers_whoever_is_asked(pair: RunningService) -> None:
    for _ in range(40):
        # A new connection each time: any worker may take it.
        assert httpx.post(pair.url + "/v1/associate", json=examples.ASSOCIATE).status_code == 200
    line = 'linefix_http_requests_total{method="POST",route="/v1/associate",status="200"}'
    texts = [httpx.get(pair.url + "/metrics").text for _ in range(10)]
    assert all(f"{line} 40.0" in text for text in texts)
    assert metric(pair, 'linefix_verdicts_total{status="ok",usable="true"}') == 40.0
    # A worker that is killed takes none of its counts with it.
    for pid in workers_of(pair):
        os.kill(pid, signal.SIGKILL)
    until(lambda: pair.log().count('"ready"') == 4)
    assert metric(pair, line) == 40.0


def test_a_worker_that_dies_is_replaced_and_the_other_answers_meanwhile(pair: RunningService) -> None:
    before = workers_of(pair)
    assert len(before) == 2
    os.kill(min(before), signal.SIGKILL)
    failed = 0
    while pair.log().count('"ready"') < 3:
        with suppress(httpx.TransportError):
            failed += httpx.get(pair.url + "/readyz").status_code != 200
    assert failed == 0
    after = workers_of(pair)
    assert len(after) == 2
    assert len(after & before) == 1
    assert "a worker has died" in pair.log()


def test_a_worker_that_hangs_is_replaced(start_service: Callable[..., RunningService]) -> None:
    running = start_service(workers=2, searches=2, hang_seconds=4)
    until(lambda: running.log().count('"ready"') == 2)
    before = workers_of(running)
    time.sleep(6.0)
    assert workers_of(running) == before  # nobody who is idle is taken for hung
    os.kill(min(before), signal.SIGSTOP)
    stopped = time.monotonic()
    until(lambda: running.log().count('"ready"') == 3)
    assert time.monotonic() - stopped < 20.0
    assert "a worker hangs" in running.log()
    assert len(workers_of(running)) == 2
    assert workers_of(running) & before == {max(before)}


def test_searches_and_queue_are_limited_over_all_workers(pair: RunningService) -> None:
    body, enough = searched_for_a_while(), threading.Event()
    statuses: list[int] = []

    def ask() -> None:
        while not enough.is_set():
            statuses.append(httpx.post(pair.url + "/v1/associate", content=body, timeout=60).status_code)

    threads = [threading.Thread(target=ask) for _ in range(16)]
    for thread in threads:
        thread.start()
    until(lambda: len(statuses) > 10)
    found = [(metric(pair, "linefix_searches_running"), metric(pair, "linefix_searches_waiting")) for _ in range(50)]
    enough.set()
    for thread in threads:
        thread.join()
    assert max(running for running, _ in found) <= 2.0
    assert max(waiting for _, waiting in found) <= 4.0
    assert set(statuses) == {200, 503}


def test_all_drain_and_end(pair: RunningService) -> None:
    answers: list[int] = []
    body = heavy_body()

    def ask() -> None:
        answers.append(httpx.post(pair.url + "/v1/associate", content=body, timeout=60).status_code)

    busy = threading.Thread(target=ask)
    busy.start()
    time.sleep(0.2)
    pids = workers_of(pair)
    pair.process.send_signal(signal.SIGTERM)
    assert pair.process.wait(15) == 0
    busy.join()
    assert answers == [200]
    assert not any(is_running(pid) for pid in pids)
    assert "Traceback" not in pair.log()
    with pytest.raises(httpx.ConnectError):
        httpx.get(pair.url + "/livez")


def test_workers_end_with_the_process_above_them(pair: RunningService) -> None:
    pids = workers_of(pair)
    pair.process.kill()
    pair.process.wait()
    until(lambda: not any(is_running(pid) for pid in pids))


def test_what_is_watched_is_read_when_asked() -> None:
    metrics, value = Metrics(), 1.0
    metrics.watch("linefix_test", "of a test", lambda: value)
    assert b"linefix_test 1.0" in metrics.exposition()
    value = 2.0
    assert b"linefix_test 2.0" in metrics.exposition()


def test_what_a_first_start_compiles_is_not_kept_in_memory(
    start_service: Callable[..., RunningService], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kernels"))
    running = start_service(probe="/livez", workers=2, searches=2)
    begun = time.monotonic()
    until(lambda: running.log().count('"ready"') == 2)
    assert time.monotonic() - begun > 5.0, "nothing was compiled"
    assert running.log().count("compiling") == 2
    for pid in workers_of(running):
        status = Path(f"/proc/{pid}/status").read_text()
        anonymous = next(int(line.split()[1]) for line in status.splitlines() if line.startswith("RssAnon"))
        assert anonymous < 200_000  # kB; with the compiler in it, 480,000
