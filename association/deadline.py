"""The end of a search: a time, a cancellation, or both, and the flag by which kernels notice it.

A kernel runs without Python's global lock and cannot read the clock. Between two hypotheses it reads a flag, an array
of one byte. A thread of this module sets the flag when the time is over, and `Deadline.cancel` sets it at once.
"""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from .layout import Integers

LONGEST_WAIT = 3600.0  # s; the time that a thread may wait at once is limited


class CancelledError(Exception):
    """`Deadline.cancel` stopped the search; there is no answer."""


@dataclass(slots=True, eq=False)
class Deadline:
    """A cooperative end of the search: a time, a cancellation by another thread, or both.

    Attributes
    ----------
    at : float or None
        `time.monotonic()` seconds.
    """

    at: float | None = None
    _cancelled: bool = field(default=False, init=False)
    _outer: Deadline | None = field(default=None, init=False)

    def within(self, at: float) -> Deadline:
        """Return an end that comes no later than a time, and is cancelled with this one."""
        inner = Deadline(at if self.at is None else min(at, self.at))
        inner._outer = self
        return inner

    def cancel(self) -> None:
        """Make the search give up soon; safe from any thread."""
        self._cancelled = True
        _CLOCK.set_flags()

    @property
    def cancelled(self) -> bool:
        """Return whether `cancel` was called."""
        return self._cancelled or (self._outer is not None and self._outer.cancelled)

    @property
    def passed(self) -> bool:
        """Return whether the search has to end: it was cancelled, or its time is over."""
        return self.cancelled or (self.at is not None and time.monotonic() >= self.at)

    @contextmanager
    def watched(self) -> Iterator[Integers]:
        """Return a flag for kernels, (1,) uint8: 0, and 1 soon after the search has to end."""
        watch = _Watch(self, np.zeros(1, np.uint8))
        _CLOCK.add(watch)
        try:
            yield watch.flag
        finally:
            _CLOCK.remove(watch)


@dataclass(slots=True, eq=False)
class _Watch:
    """A deadline, and the flag that is set when it has passed."""

    deadline: Deadline
    flag: Integers


class _Clock:
    """Sets the flags of deadlines that have passed; one daemon thread waits for the next of their times."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._watches: set[_Watch] = set()
        self._wakes_at = math.inf
        self._thread: threading.Thread | None = None

    def add(self, watch: _Watch) -> None:
        """Set a flag from now on, as soon as its deadline has passed."""
        with self._changed:
            self._watches.add(watch)
            if watch.deadline.passed:
                watch.flag[0] = 1
            elif watch.deadline.at is not None and watch.deadline.at < self._wakes_at:
                self._wake()

    def remove(self, watch: _Watch) -> None:
        """Leave a flag as it is from now on."""
        with self._changed:
            self._watches.discard(watch)

    def set_flags(self) -> None:
        """Set the flags of all deadlines that have passed."""
        with self._changed:
            for watch in self._watches:
                if watch.deadline.passed:
                    watch.flag[0] = 1

    def _wake(self) -> None:
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="deadlines", daemon=True)
            self._thread.start()
        else:
            self._changed.notify()

    def _run(self) -> None:
        with self._changed:
            while True:
                self.set_flags()
                now = time.monotonic()
                times = [watch.deadline.at for watch in self._watches if not watch.flag[0]]
                self._wakes_at = min((at for at in times if at is not None), default=math.inf)
                self._changed.wait(max(0.0, min(self._wakes_at - now, LONGEST_WAIT)))


def _start_over() -> None:
    """Forget the thread, which a forked process does not have."""
    global _CLOCK
    _CLOCK = _Clock()


_CLOCK = _Clock()
os.register_at_fork(after_in_child=_start_over)
