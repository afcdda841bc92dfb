"""End of the process."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx
import pytest

from tests.running import RunningService, client_of, family_of, is_running, until
from tests.running import running as running_service
from tests.service.searches import searched_for, store_hard_map


@pytest.mark.parametrize("workers", [1, pytest.param(2, marks=pytest.mark.long)])
def test_sigterm_drains_and_ends(start_service: Callable[..., RunningService], workers: int) -> None:
    running = start_service(drain_s=1.0, workers=workers, searches=workers)
    store_hard_map(running, workers)
    family = family_of(running.process.pid)
    with ThreadPoolExecutor(1) as thread, client_of(running.url) as client:
        asked = thread.submit(client.post, "/v1/associate", content=searched_for())
        until(lambda: running.count("linefix_searches_running") == 1.0)
        running.process.send_signal(signal.SIGTERM)
        until(lambda: running.client.get("/readyz").status_code == 503)
        assert (
            "the service is shutting down; send the request to another"
            in running.client.get("/readyz").json()["detail"]
        )
        assert running.client.get("/livez").status_code == 200
        running.process.send_signal(signal.SIGTERM)  # told again: it ends no sooner
        assert running.ended() == 0
        assert asked.result().status_code == 200
    until(lambda: not any(is_running(pid) for pid in family))  # Python's own tracker ends some ms later
    with pytest.raises(httpx.ConnectError):
        httpx.get(running.url + "/livez")
    assert "Traceback" not in running.log()


@pytest.mark.parametrize("first", [signal.SIGHUP, pytest.param(signal.SIGINT, marks=pytest.mark.long)])
def test_a_terminal_that_goes_away_drains_it_and_ctrl_c_cuts_it_short(
    start_service: Callable[..., RunningService], first: signal.Signals
) -> None:
    """It ended at once, without its last answers."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # nohup may ignore it
    try:
        running = start_service(drain_s=5.0)
    finally:
        signal.signal(signal.SIGHUP, before)
    begun = time.monotonic()
    running.process.send_signal(first)
    until(lambda: running.client.get("/readyz").status_code == 503)
    running.process.send_signal(signal.SIGINT)
    assert running.ended() == 0
    assert time.monotonic() - begun < 5.0
    assert "Traceback" not in running.log()


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
