"""Move each threshold of the search and the verdict by 20 % either way, and count the answers that change.

A sample of scans is answered with the thresholds as they are, then with each of them moved. Counted are answers that
change, and those that are right, usable, and usable but wrong. Thresholds that a kernel reads are compiled in. With
``--compiled`` each of these runs in a process of its own, which compiles the kernels that depend on it.

``python -m benchmarks.sensitivity [--answers 120] [--compiled] [--only NAME ...] [--list]``
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Iterator, Sequence

from .compiled_thresholds import run_compiled
from .outcomes import progress
from .table import Row, print_table
from .threshold_effects import MOVED, Effect, Sampled, effect_of, print_effects, sample, timed
from .thresholds import Threshold, is_of_index, moved, thresholds

ANSWERS = 120


def effects(some: Sequence[Sampled], chosen: Sequence[Threshold]) -> Iterator[tuple[Threshold, list[Effect]]]:
    """Move each of some thresholds that no kernel reads, either way; yield it with the effects."""
    timed(some)
    before = timed(some)[0]
    seconds = {again: statistics.median(timed(some, index_again=again)[1] for _ in range(3)) for again in (False, True)}
    for number, threshold in enumerate(chosen):
        found, again = [], is_of_index(threshold)
        for factor in MOVED:
            try:
                with moved(threshold, threshold.moved(factor)):
                    after, took = timed(some, index_again=again)
                found.append(effect_of(before, after, took / seconds[again]))
            except Exception as error:
                found.append(Effect(failed=f"{type(error).__name__}: {error}"))
        progress("thresholds", number + 1, len(chosen))
        yield threshold, found


def sensitivity(quick: int) -> list[Row]:
    """Move all thresholds that Python reads."""
    run(max(10, ANSWERS // quick), [one for one in thresholds() if not one.compiled])
    return []


def run(count: int, chosen: Sequence[Threshold]) -> None:
    """Print the effects of some thresholds that Python reads on a sample of so many answers."""
    some, every = sample(count), thresholds()
    found = list(effects(some, chosen))
    read = sum(not one.compiled for one in every)
    with_beams = sum(one.with_beams for one in some)
    print(f"\n{len(every)} thresholds, {read} read by Python only; {len(some)} answers, {with_beams} with ranges")
    print("Drives, causes and other units are not in the sample: their thresholds change nothing here.")
    print_effects("Thresholds moved by 20 %: answers that change", found)
    still = [one.name for one, both in found if not any(effect.changed or effect.failed for effect in both)]
    print(f"\n{len(still)} of {len(found)} change nothing: {', '.join(still)}")


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.sensitivity", description=__doc__)
    parser.add_argument("--answers", type=int, default=ANSWERS, help="size of the sample")
    parser.add_argument("--only", nargs="*", metavar="NAME", help="move these thresholds only")
    parser.add_argument("--list", action="store_true", help="list the thresholds, and whether a kernel reads them")
    parser.add_argument("--compiled", action="store_true", help="move those that kernels read")
    args = parser.parse_args()
    chosen = [one for one in thresholds() if args.only is None or one.name in args.only]
    if args.list:
        cells = [(one.module, one.name, str(one.value), "kernel" if one.compiled else "Python") for one in chosen]
        print_table(f"{len(chosen)} thresholds", ("module", "name", "value", "read by"), cells)
        return
    chosen = [one for one in chosen if one.compiled == args.compiled]
    if args.compiled:
        run_compiled(args.answers, chosen)
    else:
        run(args.answers, chosen)


if __name__ == "__main__":
    main()
