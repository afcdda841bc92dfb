"""Bodies to parse."""

from __future__ import annotations

import numpy as np
import orjson

from linefix.documents import examples
from linefix.documents.limits import Limits
from service.parsing.child import LARGE

LIMITS = Limits(values=2_000_000, map_segments=200_000, scan_segments=2_000, beams=20_000, pairs=200_000, batch=256)


def large_map(count: int = 20_000, *, least: int = LARGE) -> bytes:
    """A room, and far away many short walls."""
    begins = np.random.default_rng(0).uniform(1e3, 2e3, (count, 2))
    segments = np.vstack([examples.WALLS, np.hstack([begins, begins + np.array([1.0, 0.1])])])
    body = orjson.dumps({"segments": segments}, option=orjson.OPT_SERIALIZE_NUMPY)
    assert len(body) > least
    return body
