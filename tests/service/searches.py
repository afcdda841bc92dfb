"""Requests that keep a service busy."""

from __future__ import annotations

import numpy as np
import orjson

from tests.running import RunningService


def store_hard_map(running: RunningService) -> None:
    """Store a map for `searched_for`, and have it indexed: the search is all that is left to do."""
    rng = np.random.default_rng(1)
    begins, angles = rng.uniform(0.0, 300.0, (30_000, 2)), rng.uniform(0.0, np.pi, 30_000)
    walls = np.hstack([begins, begins + 3.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    body = orjson.dumps({"segments": walls}, option=orjson.OPT_SERIALIZE_NUMPY)
    assert running.client.put("/v1/maps/hard", content=body).status_code == 201
    assert running.client.post("/v1/associate", content=searched_for(2.0)).status_code == 200


def searched_for(seconds: float = 4.0) -> bytes:
    """A request that takes as long as this: by far more can be tried than its deadline lets."""
    rng = np.random.default_rng(2)
    begins, angles = rng.uniform(-5.0, 5.0, (40, 2)), rng.uniform(0.0, np.pi, 40)
    seen = np.hstack([begins, begins + np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    options = {"exhaustive": True, "deadline_ms": round(1e3 * seconds)}
    body = {"map": {"map_id": "hard"}, "scan": {"segments": seen}, "options": options}
    return orjson.dumps(body, option=orjson.OPT_SERIALIZE_NUMPY)


def searched_briefly() -> bytes:
    """A request that takes some ten milliseconds: nothing in the scan is on the map."""
    rng = np.random.default_rng(1)
    begins = rng.uniform(0.0, 50.0, (800, 2))
    angles = rng.uniform(0.0, np.pi, 800)
    segments = np.hstack([begins, begins + 2.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    seen = rng.uniform(-5.0, 5.0, (30, 4))
    body = {"map": {"segments": segments}, "scan": {"segments": seen}, "options": {"exhaustive": True}}
    return orjson.dumps(body, option=orjson.OPT_SERIALIZE_NUMPY)
