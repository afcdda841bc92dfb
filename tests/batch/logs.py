"""A room, and logs of scans taken in it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

ROOM = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
SEEN = [[-1.01, 0.99, -0.99, -4.98], [-1.00, -4.99, 0.98, -5.01], [1.01, -2.99, 3.98, -3.01], [4.01, -2.98, 3.99, 0.98]]
SEGMENTS = pa.list_(pa.list_(pa.float64()))


def write_room(folder: Path, name: str = "room") -> Path:
    path = folder / f"{name}.json"
    path.write_text(json.dumps({"segments": ROOM}))
    return path


def write_log(path: Path, count: int, **columns: Any) -> Path:
    """Write a log of so many equal scans; other columns as they are given."""
    table: dict[str, Any] = {
        "segments": pa.array([SEEN] * count, type=SEGMENTS),
        "stamp": pa.array(range(count), type=pa.int64()),
    }
    pq.write_table(pa.table(table | columns), path)
    return path


def rows(path: Path) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = pq.read_table(path).to_pylist()
    return found


def without_times(found: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return [{name: value for name, value in row.items() if name != "search_ms"} for row in found]
