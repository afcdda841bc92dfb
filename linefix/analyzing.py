"""Places of an analysis, tried on all cores."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from functools import partial

from association import Deadline
from map_quality import Analysis, PlaceVerdict, finished

PORTION = 16  # places that a process is given at a time
ALONE = 64  # places up to which starting others takes longer than it saves

Progress = Callable[[int, int], None]
Looks = dict[int, PlaceVerdict | None]
_analysis: Analysis | None = None  # of a process that was started for it
_deadline = Deadline()


def look_on_all_cores(analysis: Analysis, deadline: Deadline, progress: Progress) -> Looks:
    """Try every place, and return the results of those for which there was time.

    The verdicts are the same however many cores there are. `progress` is called with the number of places that are
    done, and of all.
    """
    order, found = analysis.standing.order.tolist(), dict[int, PlaceVerdict | None]()
    portions = [order[k : k + PORTION] for k in range(0, len(order), PORTION)]
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    with ExitStack() as stack:
        done: Iterator[Looks] = (finished(looks(analysis, portion, deadline)) for portion in portions)
        if cores > 1 and len(order) > ALONE:
            # Spawned, never forked: this process has threads.
            context = multiprocessing.get_context("spawn")
            pool = ProcessPoolExecutor(min(cores, len(portions)), context, _begin, (analysis, deadline.at))
            stack.callback(partial(pool.shutdown, cancel_futures=True))
            done = pool.map(_look_here, portions)
        for some in done:
            found |= some
            progress(len(found), len(order))
    return found


def looks(analysis: Analysis, portion: Sequence[int], deadline: Deadline) -> Generator[None, None, Looks]:
    """Try some places, a scan at a step, and return the results of those for which there was time."""
    found: Looks = {}
    for number in portion:
        verdict = yield from analysis.looking(number, deadline)
        if deadline.passed:
            return found  # an unfinished result is no answer: the search was cut
        yield
        found[number] = verdict
    return found


def _begin(analysis: Analysis, ends_at: float | None) -> None:
    """Take the analysis once in each process; `ends_at` is of the machine's monotonic clock."""
    global _analysis, _deadline
    _analysis, _deadline = analysis, Deadline(ends_at)


def _look_here(portion: Sequence[int]) -> Looks:
    assert _analysis is not None
    return finished(looks(_analysis, portion, _deadline))
