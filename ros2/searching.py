"""Searches in a thread of their own, so that the main loop goes on reading, reporting and ending meanwhile."""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import linefix
from registration import InputError

from .locating import Located, locate
from .looking import Look
from .messages import Time
from .tuning import SEARCH_SECONDS


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """The result of a search.

    Attributes
    ----------
    stamp : Time
        Of the newest scan.
    located : Located or None
        None where the scan cannot be searched.
    problem : str
        Why it cannot be searched.
    seconds : float
        That the search took.
    generation : int
        Of the map that was searched, as it was given.
    """

    stamp: Time
    located: Located | None
    problem: str
    seconds: float
    generation: int


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    index: linefix.MapIndex | linefix.MapSet
    looks: Sequence[Look]
    generation: int


class Searcher:
    """Searches one scan at a time.

    Parameters
    ----------
    options : AssociationOptions
        Of each search.
    found : callable
        Called in the thread of the searches when a result can be taken.
    """

    def __init__(self, options: linefix.AssociationOptions, found: Callable[[], None]) -> None:
        self._options = options
        self._tasks: queue.SimpleQueue[_Task | None] = queue.SimpleQueue()
        self._results: queue.SimpleQueue[Found] = queue.SimpleQueue()
        self._deadline = linefix.Deadline()
        self._found = found
        self.busy = False
        self._thread = threading.Thread(target=self._run, name="searches", daemon=True)
        self._thread.start()

    def submit(self, index: linefix.MapIndex | linefix.MapSet, looks: Sequence[Look], generation: int) -> None:
        """Search a scan; only while not `busy`."""
        self.busy = True
        self._tasks.put(_Task(index, looks, generation))

    def result(self) -> Found | None:
        """Return the result of the search, None where there is none yet."""
        try:
            found = self._results.get_nowait()
        except queue.Empty:
            return None
        self.busy = False
        return found

    def end(self, seconds: float) -> bool:
        """Cancel the search, and return whether its thread has ended within a time."""
        self._deadline.cancel()
        self._tasks.put(None)
        self._thread.join(seconds)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (task := self._tasks.get()) is not None:
            self._results.put(self._search(task))
            self._found()

    def _search(self, task: _Task) -> Found:
        stamp, begun = task.looks[0].stamp, time.monotonic()
        located, problem = None, ""
        try:
            located = locate(task.index, task.looks, self._options, self._deadline.within(begun + SEARCH_SECONDS))
        except InputError as error:
            problem = f"the scan cannot be used: {error}"
        except Exception as error:  # the robot goes on without this scan
            problem = f"a defect of linefix; please report it: {type(error).__name__}: {error}"
        return Found(stamp, located, problem, time.monotonic() - begun, task.generation)
