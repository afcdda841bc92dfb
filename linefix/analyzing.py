"""Places of an analysis, tried on all cores."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass
from itertools import islice
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from association import Deadline, MapIndex, MapPoints
from map_quality import Analysis, PlaceVerdict, Robot, Standing
from registration import Segments

PORTION = 16  # places that a process is given at a time
ALONE = 64  # places up to which starting others takes longer than it saves

Progress = Callable[[int, int], None]
Looks = dict[int, PlaceVerdict | None]
T = TypeVar("T")
_analysis: Analysis | None = None  # of a process that was started for it
_deadline = Deadline()


@dataclass(frozen=True, slots=True)
class Task:
    """Input of another process; it builds the index again, because an index is not sent.

    Attributes
    ----------
    endpoints : (n, 4)
        The map as sent, metres.
    sigma, points, oriented, robot, standing, seed, drive
        As in `MapIndex` and `Analysis`.
    landmark : (k, 4)
        Segments of the landmark, metres.
    ends_at : float or None
        Of the machine's monotonic clock.
    """

    endpoints: NDArray[np.float64]
    sigma: float | None
    points: MapPoints
    oriented: bool
    robot: Robot
    standing: Standing
    seed: int
    drive: float
    landmark: NDArray[np.float64]
    ends_at: float | None


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
    own = analysis.segments.endpoints
    landmark = np.empty((0, 4)) if analysis.landmark is None else analysis.landmark.segments.endpoints[len(own) :]
    index = analysis.index
    task = Task(own, index.sigma, index.points, analysis.oriented, analysis.robot, analysis.standing, analysis.seed,
                analysis.drive, landmark, deadline.at)  # fmt: skip
    with ProcessPoolExecutor(min(cores, len(portions)), context, _begin, (task,)) as pool:
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
        steps, verdict, ended = analysis.looking(number, deadline), None, False
        while not ended:
            try:
                next(steps)
            except StopIteration as done:
                verdict, ended = done.value, True
            if deadline.passed:
                return found  # an unfinished result is no answer: the search was cut
            yield
        found[number] = verdict
    return found


def finished(steps: Generator[None, None, T]) -> T:
    """Take all steps, and return their result."""
    while True:
        try:
            next(steps)
        except StopIteration as done:
            result: T = done.value
            return result


def _begin(task: Task) -> None:
    """Index the map once in each process."""
    global _analysis, _deadline
    segments = Segments.derived(task.endpoints)
    index = MapIndex.build(segments, task.sigma, oriented=task.oriented, points=task.points)
    _analysis = Analysis(index, segments, task.robot, task.standing, task.oriented, task.seed, task.drive)
    if len(task.landmark):
        _analysis = _analysis.with_segments(Segments.derived(task.landmark))
    _deadline = Deadline(task.ends_at)


def _look_here(portion: Sequence[int]) -> Looks:
    assert _analysis is not None
    return finished(looks(_analysis, portion, _deadline))
