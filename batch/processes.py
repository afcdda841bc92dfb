"""An engine of this machine's processes."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
from collections import Counter, deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from .engine import ATTEMPTS, Item, Lost, Result, attempt, checked

# A worker is a core: a second layer of threads in numpy's libraries would only get in its way.
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(slots=True)
class _Worker:
    process: BaseProcess
    pipe: Connection
    number: int | None = None  # of the item that it is at


@dataclass(frozen=True, slots=True)
class Processes:
    """Worker processes; one that ends early is replaced.

    They are spawned, never forked: the compiled kernels and the caller's threads would not outlive a fork.

    Attributes
    ----------
    count : int
        Number of processes that work at a time.
    """

    count: int

    def run(self, function: Callable[[Item], Result], items: Sequence[Item]) -> Iterator[tuple[Item, Result | Lost]]:
        """Yield each item once with its result, as they are done; see `Engine.run`."""
        waiting, losses = deque(range(len(items))), Counter[int]()
        workers: list[_Worker] = []
        try:
            with _one_thread():
                workers += [_started(function) for _ in range(min(self.count, len(items)))]
            for worker in workers:
                _give(worker, waiting, items)
            while busy := [worker for worker in workers if worker.number is not None]:
                ready = wait([worker.pipe for worker in busy])
                for worker in [worker for worker in busy if worker.pipe in ready]:
                    number = worker.number
                    assert number is not None
                    try:
                        outcome = worker.pipe.recv()
                    except (EOFError, OSError):
                        workers.remove(worker)
                        _ended(worker)
                        losses[number] += 1
                        with _one_thread():
                            worker = _started(function)
                        workers.append(worker)
                        if losses[number] < ATTEMPTS:
                            waiting.append(number)
                            _give(worker, waiting, items)
                            continue
                        outcome = Lost()
                    _give(worker, waiting, items)
                    yield items[number], checked(outcome)
        finally:
            for worker in workers:
                _ended(worker)


def _give(worker: _Worker, waiting: deque[int], items: Sequence[object]) -> None:
    """Send the next item to a worker; a worker that has just ended is noticed when its answer is read."""
    worker.number = waiting.popleft() if waiting else None
    if worker.number is not None:
        with contextlib.suppress(OSError):
            worker.pipe.send(items[worker.number])


def _started(function: Callable[[Item], Result]) -> _Worker:
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(function, theirs), daemon=True)
    process.start()
    theirs.close()  # so that ours shows the end of the worker
    return _Worker(process, ours)


def _ended(worker: _Worker) -> None:
    worker.pipe.close()
    worker.process.kill()
    worker.process.join()


def _work(function: Callable[[Item], Result], pipe: Connection) -> None:
    """Answer until the other end is closed, or its process has ended."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # from the terminal; the parent process receives it as well
    with contextlib.suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            pipe.send(attempt(function, pipe.recv()))


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
