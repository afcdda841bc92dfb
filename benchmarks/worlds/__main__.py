"""Scans of drawn worlds: ``python -m benchmarks.worlds``; as one of the tables ``python -m benchmarks worlds``.

Every case is drawn by world, condition and number, so that the answers depend neither on what else is drawn nor on the
number of processes, nor on whether Ray starts them.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from batch import OnRay, Processes

from ..table import machine
from .buildings import FAMILIES
from .conditions import CONDITIONS
from .measured.outcomes import read, write
from .measured.pictures import draw_worlds
from .measured.questions import HALVES
from .measured.report import report
from .measured.running import Choice, run


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.worlds", description=__doc__)
    parser.add_argument("--worlds", default="", help=f"with commas, or one of {', '.join(HALVES)}; by default all")
    parser.add_argument("--conditions", default=",".join(CONDITIONS), help="with commas; by default all")
    parser.add_argument("--quick", type=float, default=1.0, metavar="N", help="draw about one in N of everything")
    parser.add_argument("--first", type=int, default=0, metavar="K", help="number of the first case of each kind")
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1, metavar="N", help="by default one a core")
    parser.add_argument("--ray", action="store_true", help="on Ray: on this machine, or on what RAY_ADDRESS names")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write each answer as a line of JSON")
    parser.add_argument("--read", type=Path, metavar="FILE", help="print the tables of such a file, draw nothing")
    parser.add_argument("--pictures", action="store_true", help="draw each world with one scan as a picture, no more")
    args = parser.parse_args()
    choice = Choice(_worlds(args.worlds), tuple(args.conditions.split(",")), args.quick, args.first)
    unknown = [name for name in choice.worlds if name not in FAMILIES]
    unknown += [name for name in choice.conditions if name not in CONDITIONS]
    if unknown or not args.quick > 0.0 or args.first < 0:
        parser.error(f"no such name: {', '.join(unknown)}" if unknown else "--quick is above 0, --first 0 or more")
    if args.pictures:
        draw_worlds(choice.worlds)
        return
    print(f"{machine()}; processor time of one thread each")
    outcomes = list(read(args.read)) if args.read else run(choice, OnRay() if args.ray else Processes(args.processes))
    if args.out:
        write(args.out, outcomes)
    report(outcomes)


def _worlds(told: str) -> tuple[str, ...]:
    """Return the worlds that are meant by names with commas, by the name of a half, or by nothing."""
    if told in HALVES:
        return tuple(name for name, family in FAMILIES.items() if family.held_out == HALVES[told])
    return tuple(told.split(",")) if told else tuple(FAMILIES)


if __name__ == "__main__":
    main()
