"""Deadlines over HTTP: who asks is told in time, also where what was begun takes longer."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import orjson
import pytest

from tests.running import RunningService, client_of, until

RUNNING, KEPT = "linefix_searches_running", "linefix_map_cache_maps"
SEEN = {"segments": [[0.0, 1.0, 2.0, 1.0]]}


def slow_to_index(count: int) -> bytes:
    """Return a map that takes seconds to be indexed where directions mean nothing."""
    rng = np.random.default_rng(3)
    begins, angles = rng.uniform(0.0, 500.0, (count, 2)), rng.uniform(0.0, np.pi, count)
    walls = np.hstack([begins, begins + 3.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    return orjson.dumps({"segments": walls.round(4)}, option=orjson.OPT_SERIALIZE_NUMPY)


@pytest.mark.parametrize("path", ["/v1/associate", "/v1/associate:batch"])
def test_an_index_that_is_not_done_in_time_is_504_and_goes_on(
    start_service: Callable[..., RunningService], path: str
) -> None:
    """The answer came when the map was indexed, seconds after the deadline; who asked for the same map waited, too."""
    running = start_service(searches=2)
    running.client.put("/v1/maps/slow", content=slow_to_index(150_000)).raise_for_status()
    sought: dict[str, Any] = {"scan": SEEN} if path == "/v1/associate" else {"scans": [SEEN]}
    body = {"map": {"map_id": "slow"}, **sought}
    told: list[tuple[int, tuple[float, ...]]] = []

    def ask(deadline_ms: float | None) -> int:
        options = {"oriented": False} | ({} if deadline_ms is None else {"deadline_ms": deadline_ms})
        with client_of(running.url) as client:
            return client.post(path, json={**body, "options": options}).status_code

    def is_told_while_it_is_indexed() -> bool:
        """Where the map is not even read by then, ask again."""
        told.append((ask(500.0), running.counts(RUNNING, KEPT)))
        assert told[-1][0] == 504
        return told[-1][1] == (1.0, 0.0)

    until(is_told_while_it_is_indexed)
    with ThreadPoolExecutor(2) as threads:
        waiting, patient = threads.submit(ask, 200.0), threads.submit(ask, None)
        assert waiting.result() == 504
        assert running.count(KEPT) == 0.0
        # It was begun once, and whoever has the time gets it.
        assert patient.result() == 200
    assert running.counts(KEPT, "linefix_map_cache_misses_total") == (1.0, 1.0)
    assert "a defect" not in running.log()
