"""Requests that keep a service busy."""

from __future__ import annotations

import numpy as np
import orjson

from service.schemas import examples


def heavy_body(count: int = 100_000) -> bytes:
    """A request that takes a second or so: a large map that has to be indexed."""
    begins = np.random.default_rng(0).uniform(0.0, 1e3, (count, 2))
    segments = np.hstack([begins, begins + np.array([1.0, 0.1])])
    body = {"map": {"segments": segments}, "scan": {"segments": examples.SEEN}}
    return orjson.dumps(body, option=orjson.OPT_SERIALIZE_NUMPY)


def searched_for_a_while() -> bytes:
    """A request that takes some ten milliseconds: nothing in the scan is on the map."""
    rng = np.random.default_rng(1)
    begins = rng.uniform(0.0, 50.0, (800, 2))
    angles = rng.uniform(0.0, np.pi, 800)
    segments = np.hstack([begins, begins + 2.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)])
    seen = rng.uniform(-5.0, 5.0, (30, 4))
    body = {"map": {"segments": segments}, "scan": {"segments": seen}, "options": {"exhaustive": True}}
    return orjson.dumps(body, option=orjson.OPT_SERIALIZE_NUMPY)
