"""All figures with their goals, quality and speed: ``python -m benchmarks [table ...]``."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from . import vectorization
from .adversarial import adversarial
from .analysis import analysis
from .batch import batch
from .drawn import SCANNER
from .estimators import estimators
from .figures import record
from .floors import floors
from .grids import grids
from .growth import PAIRS, SIZES, growth
from .imports import imports
from .localization import localization
from .lookalikes import lookalikes
from .peers import peers, versions
from .plan import plan
from .queries import DATA, data_found
from .ranges import ranges
from .replicas import replicas
from .request import request
from .ros2 import ros2
from .smoothness import smoothness
from .starts import starts
from .sums import sums
from .table import Row, machine, print_rows
from .upkeep import UPKEEP
from .views import views
from .worlds import worlds

DEFAULT = ("localization", "estimators", "lookalikes")


def _localization(quick: int) -> list[Row]:
    return localization(set(), quick, listing=True)


def _estimators(quick: int) -> list[Row]:
    trials = 10_000 // quick
    rows = estimators(trials)
    print_rows(f"Estimators with known correspondences, {trials:,} trials a scene", rows)
    return rows


def _lookalikes(quick: int) -> list[Row]:
    seeds = max(2, 20 // quick)
    rows = lookalikes(seeds)
    print_rows(f"Look-alikes, {seeds} scans a scene", rows)
    return rows


def _growth(quick: int) -> list[Row]:
    return growth(max(5, 30 // quick), SIZES if quick == 1 else SIZES[:-1], PAIRS if quick == 1 else PAIRS[:-1])


def _vectorization(quick: int) -> list[Row]:
    print("\n### Vectorization\n")
    scenes = (vectorization.floorplan_scenes if data_found() else vectorization.drawn_scenes)(300 // quick)
    vectorization.speed(scenes[:: max(1, len(scenes) // 60)])
    vectorization.accuracy("2 cm, sigma given", scenes, SCANNER, SCANNER.sigma)
    vectorization.accuracy("2 cm, sigma estimated", scenes, SCANNER, None)
    return []


def _ranges(quick: int) -> list[Row]:
    rows = ranges(quick)
    print_rows("Logs with their raw ranges", rows)
    return rows


def _analyze(quick: int) -> list[Row]:
    rows = analysis(quick)
    print_rows("Analysis of maps next to the logs", rows)
    return rows


def _floors(quick: int) -> list[Row]:
    rows = floors(scans=max(2, 8 // quick), buildings=2 if quick == 1 else 1, repeats=max(10, 100 // quick))
    print_rows("Floors", rows)
    return rows


def _adversarial(quick: int) -> list[Row]:
    return adversarial(max(1, 5 // quick))


def _peers(quick: int) -> list[Row]:
    print(f"\nPeers: {versions()}")
    return peers(quick)


def _sums(quick: int) -> list[Row]:
    changes = 1_000_000 // quick
    rows = sums(changes)
    print_rows(f"Sums after {changes:,} additions and removals, relative to fresh ones", rows)
    return rows


TABLES: dict[str, Callable[[int], list[Row]]] = {
    "localization": _localization,
    "estimators": _estimators,
    "lookalikes": _lookalikes,
    "growth": _growth,
    "vectorization": _vectorization,
    "ranges": _ranges,
    "analyze": _analyze,
    "adversarial": _adversarial,
    "floors": _floors,
    "grids": grids,
    "peers": _peers,
    "request": request,
    "sums": _sums,
    "worlds": worlds,
    "imports": imports,
    "batch": batch,
    "views": views,
    "replicas": replicas,
    "smoothness": smoothness,
    "plan": plan,
    "ros2": ros2,
    **UPKEEP,
    "starts": starts,
}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("tables", nargs="*", help=f"of {', '.join(TABLES)}, or all; by default {', '.join(DEFAULT)}")
    parser.add_argument(
        "--results", type=Path, metavar="FILE", help="write the rows into this file, such as benchmarks/results.json"
    )
    parser.add_argument("--quick", type=int, default=1, metavar="N", help="take about one in N of everything")
    args = parser.parse_args()
    names = list(TABLES) if args.tables == ["all"] else args.tables or list(DEFAULT)
    names = [one for name in names for one in (UPKEEP if name == "upkeep" else (name,))]
    unknown = [name for name in names if name not in TABLES]
    if unknown or args.quick < 1:
        parser.error(f"no such table: {', '.join(unknown)}" if unknown else "--quick takes a number from 1 up")
    print(f"{machine()}; one thread; data: {DATA.name if data_found() else 'absent, drawn offices instead'}")
    rows: list[Row] = []
    for name in names:
        found = TABLES[name](args.quick)
        rows += found
        if args.results is not None:
            quick = "" if args.quick == 1 else f" --quick {args.quick}"
            record(args.results, name, f"python -m benchmarks {name}{quick}", found)
    short = [row for row in rows if row.met is False]
    missed = [row for row in rows if row.aimed is False]
    print(f"\n{sum(row.met is True for row in rows)} goals met, {len(short)} short; {len(missed)} aims missed.")
    for kind, found in (("short", short), ("aim missed", missed)):
        for row in found:
            print(f"- {kind}: {row.what.strip()}: {row.measured}, {row.goal if kind == 'short' else row.aim}")


if __name__ == "__main__":
    main()
