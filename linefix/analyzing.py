"""Places of an analysis, tried on all cores."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from itertools import islice

from association import Deadline
from map_quality import Analysis, PlaceVerdict, finished

PORTION = 16  # places that a process is given at a time
ALONE = 64  # places up to which starting others takes longer than it saves

Progress = Callable[[int, int], None]
Looks = dict[int, PlaceVerdict | None]
_analysis: Analysis | None = None  # of a process that was started for it
_deadline = Deadline()


def look_on_all_cores(analysis: Analysis, cores: int, deadline: Deadline, progress: Progress) -> Looks:
    """Try every place, and return the results of those for which there was time.

    The verdicts are the same however many cores there are.

    Parameters
    ----------
    analysis : Analysis
    cores : int
    deadline : Deadline
    progress : callable
        Called with the number of places that are done, and of all.
    """
    order = analysis.standing.order.tolist()
    portions = [order[k : k + PORTION] for k in range(0, len(order), PORTION)]
    found: Looks = {}
    if cores == 1 or len(order) <= ALONE:
        for portion in portions:
            found |= finished(looks(analysis, portion, deadline))
            progress(len(found), len(order))
        return found
    # Spawned, never forked: this process has threads.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(cores, len(portions)), context, _begin, (analysis, deadline.at)) as pool:
        todo, running = iter(portions), set[Future[Looks]]()
        while True:
            running |= {pool.submit(_look_here, portion) for portion in islice(todo, 2 * cores - len(running))}
            if not running:
                return found
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for one in done:
                found |= one.result()
            progress(len(found), len(order))


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
