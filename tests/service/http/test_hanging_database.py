"""A database that takes connections and then says nothing: only those wait who need it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from linefix.documents import examples
from tests.running import RunningService, asked_again, client_of, until
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

    def ask() -> None:
        body = {**STORED, "options": {"deadline_ms": 1500}}
        with client_of(running.url) as client:
            statuses.append(client.post("/v1/associate", json=body).status_code)

    with asked_again(6, ask):
        until(lambda: len(statuses) > 0)  # so all of them have come, and wait again
        batch = {"map": INLINE["map"], "scans": [INLINE["scan"]]}
        for path, body in (("/v1/associate", INLINE), ("/v1/associate:batch", batch)):
            assert running.client.post(path, json=body).status_code == 200
            assert running.count("linefix_searches_running") == 0.0
    assert set(statuses) == {504}
    assert running.client.get("/v1/maps/m").json()["code"] == "not_ready"
    line.mend()
    until(lambda: running.client.post("/v1/associate", json=STORED).status_code == 200)
    assert "a defect" not in running.log()
