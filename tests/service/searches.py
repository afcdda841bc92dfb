"""Requests that keep a service busy."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import orjson

from tests.running import RunningService, client_of, until

POST = b"POST /v1/associate HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"


def post(body: bytes) -> bytes:
    """Return the bytes of a request for an association."""
    return POST + b"Content-Length: %d\r\n\r\n" % len(body) + body


def store_hard_map(running: RunningService, workers: int = 1) -> None:
    """Store a map for `searched_for`, and have every worker index it: the search is all that is left to do."""
    rng = np.random.default_rng(1)
    begins, angles = rng.uniform(0.0, 120.0, (30_000, 2)), rng.uniform(0.0, np.pi, 30_000)
    walls = np.hstack([begins, begins + 3.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    body = orjson.dumps({"segments": walls}, option=orjson.OPT_SERIALIZE_NUMPY)
    assert running.client.put("/v1/maps/hard", content=body).status_code == 201
    brief = searched_for(0.1)

    def is_indexed() -> bool:
        # Over a new connection: any worker may take it. One that still indexes when the time is over states it, and
        # has no place for another as long as it does.
        with client_of(running.url) as client:
            status = client.post("/v1/associate", content=brief).status_code
        assert status in (200, 503, 504)
        return status == 200 and running.count("linefix_map_cache_misses_total") >= workers

    until(is_indexed)


def searched_for(seconds: float = 4.0) -> bytes:
    """A request that takes as long as this, up to some 20 s: more can be tried than its deadline lets."""
    rng = np.random.default_rng(2)
    begins, angles = rng.uniform(-5.0, 5.0, (40, 2)), rng.uniform(0.0, np.pi, 40)
    seen = np.hstack([begins, begins + np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    options = {"exhaustive": True, "deadline_ms": round(1e3 * seconds)}
    body = {"map": {"map_id": "hard"}, "scan": {"segments": seen}, "options": options}
    return orjson.dumps(body, option=orjson.OPT_SERIALIZE_NUMPY)


def slow_to_index(walls: int) -> bytes:
    """Return a map that takes seconds to be indexed where directions mean nothing."""
    rng = np.random.default_rng(3)
    begins, angles = rng.uniform(0.0, 500.0, (walls, 2)), rng.uniform(0.0, np.pi, walls)
    segments = np.hstack([begins, begins + 3.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    return orjson.dumps({"segments": segments.round(4)}, option=orjson.OPT_SERIALIZE_NUMPY)


@contextmanager
def searching(running: RunningService) -> Iterator[None]:
    """Have the hard map searched for as long as the block takes; then its client hangs up."""
    with running.connection() as connection:
        connection.sendall(post(searched_for(30.0)))
        until(lambda: running.count("linefix_searches_running") == 1.0)
        yield
        assert running.count("linefix_searches_running") >= 1.0


def searched_briefly() -> bytes:
    """A request that takes some ten milliseconds: nothing in the scan is on the map."""
    rng = np.random.default_rng(1)
    begins = rng.uniform(0.0, 50.0, (800, 2))
    angles = rng.uniform(0.0, np.pi, 800)
    segments = np.hstack([begins, begins + 2.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    seen = rng.uniform(-5.0, 5.0, (30, 4))
    body = {"map": {"segments": segments}, "scan": {"segments": seen}, "options": {"exhaustive": True}}
    return orjson.dumps(body, option=orjson.OPT_SERIALIZE_NUMPY)
