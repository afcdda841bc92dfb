"""Deadlines over HTTP: the client gets an answer in time, also if the search takes longer."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count

import pytest

from tests.running import RunningService, until
from tests.service.searches import slow_to_index

RUNNING, BEGUN = "linefix_indexing_running", "linefix_map_cache_misses_total"
SEEN = {"segments": [[0.0, 1.0, 2.0, 1.0]]}


@pytest.mark.long
def test_an_index_that_is_not_done_in_time_is_504_and_goes_on(start_service: Callable[..., RunningService]) -> None:
    """The answer came when the map was indexed, seconds after the deadline; who asked for the same map waited, too."""
    running = start_service(searches=2)
    slow = slow_to_index(100_000)
    tries = count(1)

    def ask(map_id: str, deadline_ms: float) -> int:
        body = {"map": {"map_id": map_id}, "scan": SEEN, "options": {"oriented": False, "deadline_ms": deadline_ms}}
        return running.client.post("/v1/associate", json=body).status_code

    def both_are_told_while_it_is_indexed() -> bool:
        """Where the map is not even read by then, or is indexed already, try again with another, and more time."""
        number = next(tries)
        brief = 300.0 * 2.0 ** (number % 5 - 1)
        map_id = f"slow-{number}"
        running.client.put(f"/v1/maps/{map_id}", content=slow).raise_for_status()
        told = [(ask(map_id, deadline_ms), running.count(RUNNING) >= 1.0) for deadline_ms in (brief, 200.0)]
        assert {status for status, _ in told} <= {200, 504}
        until(lambda: ask(map_id, 30_000.0) == 200, patience=240.0)
        assert running.count(BEGUN) == number  # once, for all of them
        until(lambda: running.count(RUNNING) == 0.0)
        return told == [(504, True), (504, True)]

    until(both_are_told_while_it_is_indexed)
    assert "a defect" not in running.log()
