"""Engines: they call a function for each of many items, in processes of this machine or on Ray."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import pickle
import signal
import traceback
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, Protocol, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

ATTEMPTS = 3  # at an item, if its workers end early


@dataclass(frozen=True, slots=True)
class Lost:
    """Instead of a result: each worker that had the item ended before it was done."""


class Engine(Protocol):
    """Calls a function for many items.

    An item whose worker ends early is done again, up to `ATTEMPTS` times.
    """

    def run(self, function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[Item, Result | Lost]]:
        """Yield each item once with its result, as they are done.

        Parameters
        ----------
        function : callable
            Importable by its name, without side effects that a second call would spoil.
        items : sequence
            Can be pickled.

        Raises
        ------
        WorkerError
            When the function raised; then nothing more is done.
        """
        ...


class WorkerError(Exception):
    """The function raised, which is a defect; the message is the worker's traceback."""


def attempt(function: Callable[[Any], Any], item: Any) -> tuple[Any, str]:
    """Return the result, and the exception as text, since not every exception can be pickled."""
    try:
        return function(item), ""
    except Exception:
        return None, traceback.format_exc()


def checked(outcome: tuple[Any, str]) -> Any:
    """Return a result; raises `WorkerError` when it is none."""
    result, error = outcome
    if error:
        raise WorkerError(error)
    return result


# A worker is a core: a second layer of threads in numpy's libraries would only get in its way.
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True, slots=True)
class Processes:
    """Worker processes; one that ends early is replaced. They stay for the next run, and end with this object.

    They are spawned, never forked: the compiled kernels and the caller's threads would not outlive a fork.

    Attributes
    ----------
    count : int
        Number of processes that work at a time.
    """

    count: int
    _idle: list[tuple[BaseProcess, Connection]] = field(default_factory=list)

    def run(self, function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[Item, Result | Lost]]:
        """Yield each item once with its result, as they are done; see `Engine.run`."""
        waiting, losses = deque(range(len(items))), Counter[int]()
        running: dict[Connection, tuple[BaseProcess, int]] = {}  # by the pipe of each worker; the number of its item
        done: list[tuple[Item, Result | Lost]] = []
        try:
            while waiting or running:
                while waiting and len(running) < self.count:
                    process, pipe = self._idle.pop() if self._idle else _started()
                    running[pipe] = process, waiting.popleft()
                    with contextlib.suppress(OSError):  # it has just ended, which is noticed when its answer is read
                        pipe.send((function, items[running[pipe][1]]))
                yield from done
                done.clear()
                for ready in wait(list(running)):
                    assert isinstance(ready, Connection)
                    process, number = running.pop(ready)
                    try:
                        done.append((items[number], checked(ready.recv())))
                        self._idle.append((process, ready))
                    except (EOFError, OSError):
                        _end(process, ready)
                        losses[number] += 1
                        if losses[number] < ATTEMPTS:
                            waiting.append(number)
                        else:
                            done.append((items[number], Lost()))
            yield from done
        finally:
            for pipe, (process, _) in running.items():
                _end(process, pipe)


def _started() -> tuple[BaseProcess, Connection]:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(theirs,), daemon=True)
    with _one_thread():
        process.start()
    theirs.close()  # so that ours shows the end of the worker
    return process, ours


def _end(process: BaseProcess, pipe: Connection) -> None:
    pipe.close()
    process.kill()
    process.join()


def _work(pipe: Connection) -> None:
    """Call functions for items until the other end is closed, or its process has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # from the terminal; the parent process receives it as well
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            pipe.send(attempt(*pipe.recv()))


@contextlib.contextmanager
def _one_thread() -> Iterator[None]:
    """Set what numpy's libraries of a new process read when they are loaded."""
    added = [name for name in ONE_THREAD if name not in os.environ]
    os.environ.update(dict.fromkeys(added, "1"))
    try:
        yield
    finally:
        for name in added:
            del os.environ[name]


@dataclass(frozen=True, slots=True)
class OnRay:
    """Workers of a Ray cluster, each of one core.

    Ray chooses their place: the cluster that the caller is connected to, that of ``RAY_ADDRESS``, or a new one on this
    machine. Each machine needs Linefix, and the logs, the maps and the place of the output under the same paths.
    """

    def run(self, function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[Item, Result | Lost]]:
        """Yield each item once with its result, as they are done; see `Engine.run`."""
        if not items:
            return
        import ray.data

        # Items that are lost for good stay out of the results; `left` shows them.
        ray.data.DataContext.get_current().max_errored_blocks = -1
        rows = [{"number": number, "item": pickle.dumps(item)} for number, item in enumerate(items)]
        # An item each: a lost worker costs one, and no more of them than there are cores are held anywhere.
        asked = ray.data.from_items(rows, override_num_blocks=len(rows))
        done = asked.map(_Call(function), num_cpus=1, max_retries=ATTEMPTS)
        left = set(range(len(items)))
        for row in done.iter_rows():
            outcome = checked(pickle.loads(row["outcome"]))
            left.remove(row["number"])
            yield items[row["number"]], outcome
        for number in sorted(left):
            yield items[number], Lost()


@dataclass(frozen=True, slots=True)
class _Call:
    """One row of a data set to another."""

    function: Callable[[Any], Any]

    def __call__(self, row: dict[str, Any]) -> dict[str, Any]:
        outcome = attempt(self.function, pickle.loads(row["item"]))
        return {"number": row["number"], "outcome": pickle.dumps(outcome)}
