"""Fractions of named mistakes of a caller, and of mistakes named without cause: ``causes`` on the floor plans."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace

from association import AssociationResult, MapIndex, Scan, WarningCode, associate
from association.scan.scan import mirrored, scaled, turned_round

from .collection import Collection, MapKey, Query
from .outcomes import OPTIONS, WARM_UP, other_map
from .queries import floor_plans
from .table import Row, at_most, mean, print_table, quantile

EVERY = 5  # of the plans' scans one in so many
MOST_TIMES, LEAST_SECONDS = 2.0, 0.02  # of the search, for causes; where it took nearly none
NAMES: tuple[WarningCode, ...] = ("mirrored", "reversed", "unit_scale")
MADE: dict[str, Callable[[Scan], Scan]] = {
    "none": lambda scan: scan,
    "mirrored": mirrored,
    "reversed": turned_round,
    "in centimetres": lambda scan: scaled(scan, 100.0),
    "in feet": lambda scan: scaled(scan, 1.0 / 0.3048),
    "3 % too large": lambda scan: scaled(scan, 1.03),
}


def mistakes(quick: int) -> list[Row]:
    """Print what is named by what was done to the scan; judge the time."""
    plans = floor_plans(EVERY * quick)
    cells: list[tuple[str, ...]] = []
    over: list[float] = []
    asked = [(q, q.map) for q in plans.queries]
    for name, change in MADE.items():
        cells.append(_cells(name, plans, asked, change, over))
    cells.append(
        _cells(
            "of another building", plans, list(zip(plans.queries, other_map(plans), strict=True)), MADE["none"], over
        )
    )
    head = ("made", "scans", "usable", *(f"{name}, % of the others" for name in NAMES), "none of them, %")
    print_table("Mistakes that are named, of those whose answer is not usable", head, cells)
    late = [max(0.0, one) for one in over]
    return [
        at_most("beyond what causes may take, share of answers", mean(one > 0.0 for one in late), None, 0.01, ".3f"),
        Row("  by how much, p95 / worst ms", f"{quantile(late, 0.95):.1f} / {max(late, default=0.0):.1f}"),
    ]


def _cells(
    name: str,
    plans: Collection,
    asked: list[tuple[Query, MapKey]],
    change: Callable[[Scan], Scan],
    over: list[float],
) -> tuple[str, ...]:
    results = []
    for k, (query, key) in enumerate(asked):
        index, scan = plans.index(key), change(query.scan)
        if k < WARM_UP:
            _timed(index, scan, causes=True)
        result, seconds = _timed(index, scan, causes=True)
        results.append(result)
        if not result.usable:
            _, alone = _timed(index, scan, causes=False)
            over.append(1e3 * (seconds - alone - max(LEAST_SECONDS, MOST_TIMES * alone)))
    refused = [r for r in results if not r.usable]
    told = Counter(w.code for r in refused for w in r.warnings if w.code in NAMES)
    silent = sum(not any(w.code in NAMES for w in r.warnings) for r in refused)
    shares = [*(told[code] for code in NAMES), silent]
    usable = f"{mean(r.usable for r in results):.2f}"
    return name, str(len(results)), usable, *(f"{100.0 * n / max(1, len(refused)):.1f}" for n in shares)


def _timed(index: MapIndex, scan: Scan, *, causes: bool) -> tuple[AssociationResult, float]:
    began = time.perf_counter()
    result = associate(index, scan, None, replace(OPTIONS, causes=causes))
    return result, time.perf_counter() - began
