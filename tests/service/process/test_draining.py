"""How the process ends."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable

import httpx

from tests.running import RunningService, until
from tests.service.searches import heavy_body


def test_sigterm_drains_and_ends(start_service: Callable[..., RunningService]) -> None:
    running = start_service(drain_seconds=1.0)
    answers: list[int] = []
    body = heavy_body()

    def ask() -> None:
        answers.append(httpx.post(running.url + "/v1/associate", content=body, timeout=60).status_code)

    busy = threading.Thread(target=ask)
    busy.start()
    until(lambda: running.count("linefix_searches_running") == 1.0)
    begun = time.monotonic()
    running.process.send_signal(signal.SIGTERM)
    until(lambda: running.client.get("/readyz").status_code == 503)
    drained = running.client.get("/readyz")
    assert (drained.status_code, drained.json()["detail"]) == (503, "the service is going down")
    assert running.client.get("/livez").status_code == 200
    running.process.send_signal(signal.SIGTERM)  # told again: it ends no sooner
    assert running.process.wait(15) == 0
    assert 1.0 <= time.monotonic() - begun < 10.0
    busy.join()
    assert answers == [200]
    assert "Traceback" not in running.log()


def test_a_second_ctrl_c_cuts_the_draining_short(start_service: Callable[..., RunningService]) -> None:
    running = start_service(drain_seconds=5.0)
    begun = time.monotonic()
    running.process.send_signal(signal.SIGINT)
    until(lambda: running.client.get("/readyz").status_code == 503)
    running.process.send_signal(signal.SIGINT)
    assert running.process.wait(15) == 0
    assert time.monotonic() - begun < 4.0
