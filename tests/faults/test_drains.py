"""SIGTERM under load: what was accepted is answered, and the process ends in time."""

from __future__ import annotations

import json
import random
import signal
import threading
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import pytest

from linefix.documents import examples
from tests.running import client_of

CALLERS = 4


class Caller(threading.Thread):
    """Sends requests on new connections until no one listens any more."""

    def __init__(self, url: str, name: str) -> None:
        super().__init__()
        self._url, self._name = url, name
        self.answered: dict[str, int] = {}
        self.unanswered: list[str] = []

    def run(self) -> None:
        number = 0
        while True:
            number += 1
            name = f"{self._name}-{number}"
            with client_of(self._url, **{"x-request-id": name}) as client:
                try:
                    if number % 5:
                        answer = client.post("/v1/associate", json=examples.ASSOCIATE)
                    else:
                        answer = client.put(f"/v1/maps/{self._name}", json=examples.MAP)
                    answer.json()
                    self.answered[name] = answer.status_code
                except httpx.ConnectError:
                    return
                except httpx.TransportError:
                    self.unanswered.append(name)


def logged(path: Path) -> dict[str, int]:
    """Return the status of every request that came to the application."""
    lines = [json.loads(line) for line in path.read_text().splitlines() if line.startswith("{")]
    return {line["request_id"]: line["status"] for line in lines if line["message"] == "request"}


@pytest.mark.parametrize("drains", [1, pytest.param(200, marks=pytest.mark.long)])
def test_what_was_accepted_is_answered(start_service: Callable[..., Any], tmp_path: Path, drains: int) -> None:
    draw = random.Random(drains)
    total: Counter[str] = Counter()
    slowest = 0.0
    for turn in range(drains):
        running = start_service(tmp_path, drain_s=0.2)
        callers = [Caller(running.url, f"{turn}-{i}") for i in range(CALLERS)]
        for caller in callers:
            caller.start()
        while sum(len(caller.answered) for caller in callers) < 2 * CALLERS:
            time.sleep(0.01)
        time.sleep(draw.uniform(0.0, 0.3))
        begun = time.monotonic()
        running.process.send_signal(signal.SIGTERM)
        assert running.ended() == 0
        slowest = max(slowest, time.monotonic() - begun)
        for caller in callers:
            caller.join(35)
            assert not caller.is_alive()
        running.client.close()
        seen = logged(tmp_path / "log")
        (tmp_path / "log").unlink()
        for caller in callers:
            for name, status in caller.answered.items():
                assert seen[name] == status
                assert status in (200, 201, 503), (name, status)
                total[f"answered {status}"] += 1
            # Nobody took these up: the connection was still in the queue of the socket that was closed.
            assert not [name for name in caller.unanswered if name in seen]
            total["not taken up"] += len(caller.unanswered)
    print(f"\n{drains} drains, {dict(total)}, the slowest took {slowest:.1f} s")
    assert total["answered 200"] + total["answered 201"] >= 2 * CALLERS * drains
