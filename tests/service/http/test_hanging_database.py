"""A database that takes connections and then says nothing: only those wait who need it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import httpx
import pytest

from linefix.documents import examples
from tests.running import JSON, RunningService, until
from tests.service.conftest import empty_database
from tests.service.lines import Line

STORED = {"map": {"map_id": "m"}, "scan": {"segments": examples.SEEN}}
INLINE = {"map": {"segments": examples.WALLS}, "scan": {"segments": examples.SEEN}}


@pytest.fixture
def line(tmp_path: Path) -> Iterator[Line]:
    with empty_database("postgresql", tmp_path) as url, Line.to(url) as made:
        yield made


def test_inline_maps_do_not_wait_for_it(line: Line, start_service: Callable[..., RunningService]) -> None:
    """It held every search slot."""
    running = start_service(database_url=line.url, searches=1, queue=8)
    running.client.put("/v1/maps/m", json=examples.MAP).raise_for_status()
    assert running.client.post("/v1/associate", json=STORED).status_code == 200
    line.hold_up()
    statuses: list[int] = []
    enough = threading.Event()

    def ask() -> None:
        body = {**STORED, "options": {"deadline_ms": 1500}}
        while not enough.is_set():
            answer = httpx.post(running.url + "/v1/associate", json=body, headers=JSON, timeout=60)
            statuses.append(answer.status_code)

    threads = [threading.Thread(target=ask) for _ in range(6)]
    for thread in threads:
        thread.start()
    try:
        until(lambda: len(statuses) > 0)  # so all of them have come, and wait again
        for path in ("/v1/associate", "/v1/associate:batch"):
            body = INLINE if path == "/v1/associate" else {"map": INLINE["map"], "scans": [INLINE["scan"]]}
            assert running.client.post(path, json=body).status_code == 200
            assert running.count("linefix_searches_running") == 0.0
    finally:
        enough.set()
        for thread in threads:
            thread.join()
    assert set(statuses) == {504}
    assert running.client.get("/v1/maps/m").json()["code"] == "not_ready"
    line.mend()
    until(lambda: running.client.post("/v1/associate", json=STORED).status_code == 200)
    assert "a defect" not in running.log()
