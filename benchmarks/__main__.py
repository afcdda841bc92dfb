"""All figures with their goals, quality and speed: ``python -m benchmarks [table ...]``."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from .figures import record
from .grids import grids
from .growth import PAIRS, SIZES, growth
from .load import load
from .localization import localization
from .peers import peers, versions
from .queries import DATA, data_found
from .ranges import ranges
from .request import request
from .starts import starts
from .table import Row, machine, print_rows
from .views import views
from .worlds.measured import worlds

DEFAULT = ("localization", "ranges")


def _localization(quick: int) -> list[Row]:
    return localization(set(), quick, listing=True)


def _growth(quick: int) -> list[Row]:
    return growth(max(5, 30 // quick), SIZES if quick == 1 else SIZES[:-1], PAIRS if quick == 1 else PAIRS[:-1])


def _ranges(quick: int) -> list[Row]:
    rows = ranges(quick)
    print_rows("Logs with their raw ranges", rows)
    return rows


def _peers(quick: int) -> list[Row]:
    print(f"\nPeers: {versions()}")
    return peers(quick)


TABLES: dict[str, Callable[[int], list[Row]]] = {
    "localization": _localization,
    "growth": _growth,
    "ranges": _ranges,
    "grids": grids,
    "peers": _peers,
    "request": request,
    "worlds": worlds,
    "views": views,
    "load": load,
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
