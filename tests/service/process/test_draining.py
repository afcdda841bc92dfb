"""End of the process."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest

from tests.running import JSON, RunningService, until
from tests.running import running as running_service
from tests.service.searches import searched_for, store_hard_map


def test_sigterm_drains_and_ends(start_service: Callable[..., RunningService]) -> None:
    running = start_service(drain_s=1.0)
    answers: list[int] = []
    store_hard_map(running)
    body = searched_for()

    def ask() -> None:
        answers.append(httpx.post(running.url + "/v1/associate", content=body, headers=JSON, timeout=60).status_code)

    busy = threading.Thread(target=ask)
    busy.start()
    until(lambda: running.count("linefix_searches_running") == 1.0)
    running.process.send_signal(signal.SIGTERM)
    until(lambda: running.client.get("/readyz").status_code == 503)
    drained = running.client.get("/readyz")
    assert (drained.status_code, drained.json()["detail"]) == (
        503,
        "the service is shutting down; send the request to another instance, or again after its restart",
    )
    assert running.client.get("/livez").status_code == 200
    running.process.send_signal(signal.SIGTERM)  # told again: it ends no sooner
    assert running.ended() == 0
    busy.join()
    assert answers == [200]
    assert "Traceback" not in running.log()


def test_a_terminal_that_goes_away_drains_it(
    start_service: Callable[..., RunningService],
) -> None:
    """It ended at once, without its last answers."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup may ignore it
    try:
        running = start_service(drain_s=5.0)
    finally:
        signal.signal(signal.SIGHUP, before)
    running.process.send_signal(signal.SIGHUP)
    until(lambda: running.client.get("/readyz").status_code == 503)
    running.process.send_signal(signal.SIGINT)  # closes it at once
    assert running.ended() == 0
    assert "Traceback" not in running.log()


@pytest.mark.long
def test_a_second_ctrl_c_cuts_the_draining_short(start_service: Callable[..., RunningService]) -> None:
    running = start_service(drain_s=5.0)
    begun = time.monotonic()
    running.process.send_signal(signal.SIGINT)
    until(lambda: running.client.get("/readyz").status_code == 503)
    running.process.send_signal(signal.SIGINT)
    assert running.ended() == 0
    assert time.monotonic() - begun < 5.0


@pytest.mark.long
def test_started_to_outlive_its_terminal_it_does(tmp_path: Path) -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with running_service(tmp_path) as running:
            running.process.send_signal(signal.SIGHUP)
            time.sleep(0.5)
            assert running.client.get("/readyz").status_code == 200
    finally:
        signal.signal(signal.SIGHUP, before)
