"""Work on two cores under progress bars."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class Runner:
    """Pool of processes for the work; build with `runner`."""

    progress: Progress
    pool: Executor | None

    def map(self, what: str, function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
        """Return the results of a module's function in the items' order, with a bar that says `what` is done."""
        task = self.progress.add_task(what, total=len(items))
        results = []
        for result in map(function, items) if self.pool is None else self.pool.map(function, items):
            results.append(result)
            self.progress.advance(task)
        return results

    def alone(self, what: str, function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
        """Do the same in this process, one after the other: for what is timed."""
        return Runner(self.progress, None).map(what, function, items)


@contextmanager
def runner(processes: int) -> Iterator[Runner]:
    """Open a runner of some processes; with 1 all is done in this one."""
    columns = TextColumn("{task.description:<44}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Progress(*columns) as progress:
        if processes == 1:
            yield Runner(progress, None)
            return
        # Spawned: Numba's threads do not survive a fork.
        with ProcessPoolExecutor(processes, multiprocessing.get_context("spawn")) as pool:
            yield Runner(progress, pool)
