"""Floor plans and logs from the data folder, or drawn offices where it is absent.

The folder is the one that ``LINEFIX_BENCH_DATA`` names, by default ``../shared/data`` next to the repository.
"""

from __future__ import annotations

import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from registration import RigidTransform, Segments

from .collection import FLOOR_PLANS, LEVELS, Collection, Query
from .drawn import drawn_offices

DATA = Path(os.environ.get("LINEFIX_BENCH_DATA") or Path(__file__).parents[1] / ".." / "shared" / "data")
LOGS = ("intel", "seattle", "freiburg-079", "fhw", "acapulco", "edmonton")


def data_found() -> bool:
    """Tell whether there is a data folder."""
    return (DATA / "queries" / "floorplans.json").is_file()


def floor_plans(stride: int = 1) -> Collection:
    """Load the floor-plan queries, one in `stride` of them, or draw offices where there is no data."""
    if not data_found():
        return drawn_offices(max(1, 60 // stride))
    maps = {
        (family, plan["id"]): Segments.from_array(plan["segments"])
        for family in FLOOR_PLANS
        for plan in _load("floorplans", family)
    }
    queries = [
        Query(
            q["family"], q["id"], k, level, RigidTransform(*q["pose"]), Segments.from_array(q[level]), q["lead"][level]
        )
        for k, q in _one_in(stride, _load("queries", "floorplans"))
        for level in LEVELS
    ]
    return Collection("floor plans", maps, tuple(queries), distance=0.1, angle=1.0)


def logs(stride: int = 1) -> list[Collection]:
    """Load the queries of the logs, one in `stride` of them; nothing where there is no data."""
    if not data_found():
        return []
    return [_log(name, stride) for name in LOGS]


def _log(name: str, stride: int) -> Collection:
    segments = Segments.from_array(_load("linemaps", name)["segments"])
    queries = tuple(
        _query(q, (name, name, q["scan_index"], "scan"), "scan", None) for q in _load("queries", name)[::stride]
    )
    return Collection(name, {(name, name): segments}, queries, distance=0.3, angle=3.0)


def _one_in(stride: int, entries: list[Any]) -> list[tuple[int, Any]]:
    """Return some entries with their positions; drawn by seed, for families take turns in the file."""
    chosen = np.random.default_rng(stride).permutation(len(entries))[: math.ceil(len(entries) / stride)]
    return [(int(k), entries[k]) for k in np.sort(chosen)]


def _query(entry: Any, names: tuple[str, str, int, str], level: str, lead: float | None) -> Query:
    return Query(*names, RigidTransform(*entry["pose"]), Segments.from_array(entry[level]), lead)


def _load(folder: str, name: str) -> Any:
    return json.loads((DATA / folder / f"{name}.json").read_text())
