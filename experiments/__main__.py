"""All tables and figures: ``python -m experiments [name ...] [--quick] [--out out/experiments]``."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from .constant_time import constant_time
from .crumbs import crumbs
from .dispersion import dispersion
from .hypotheses import hypotheses
from .mean_angles import mean_angles
from .plan import FULL, QUICK, Plan
from .precision import precision
from .printed import printed
from .raw_beams import raw_beams
from .running import Runner, runner
from .sweep import sweep
from .unknown import basin, unknown
from .unreliable import unreliable

# Timed experiments come first, while nothing else runs.
EXPERIMENTS: dict[str, Callable[[Plan, Runner, Path], None]] = {
    "constant_time": constant_time,
    "precision": precision,
    "mean_angles": mean_angles,
    "printed": printed,
    "dispersion": dispersion,
    "unreliable": unreliable,
    "sweep": sweep,
    "crumbs": crumbs,
    "hypotheses": hypotheses,
    "raw_beams": raw_beams,
    "unknown": unknown,
    "basin": basin,
}


def run(names: Sequence[str], plan: Plan, out: Path, processes: int) -> None:
    """Run experiments; tables and figures go to `out`."""
    out.mkdir(parents=True, exist_ok=True)
    with runner(processes) as work:
        for name in names:
            EXPERIMENTS[name](plan, work, out)


def main() -> None:
    """Read the command line and run."""
    parser = argparse.ArgumentParser(prog="python -m experiments", description=__doc__)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(EXPERIMENTS)}; by default all")
    parser.add_argument("--quick", action="store_true", help="few scans: to see that it works, not for the numbers")
    parser.add_argument("--out", type=Path, default=Path("out/experiments"), help="folder of the tables and figures")
    parser.add_argument("--processes", type=int, default=2)
    args = parser.parse_args()
    unknown_names = [name for name in args.names if name not in EXPERIMENTS]
    if unknown_names:
        parser.error(f"no such experiment: {', '.join(unknown_names)}")
    if args.processes < 1:
        parser.error("--processes takes a number from 1 up")
    start = time.monotonic()
    run(args.names or list(EXPERIMENTS), QUICK if args.quick else FULL, args.out, args.processes)
    print(f"{time.monotonic() - start:.0f} s; tables and figures in {args.out}")


if __name__ == "__main__":
    main()
