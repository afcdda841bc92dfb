"""The threads of a gate: each runs one function at a time, and can be given a lower priority while it does."""

from __future__ import annotations

import os
import queue
import sys
import threading
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from typing import Any


class Running:
    """A function that a thread runs, or is about to."""

    __slots__ = ("_function", "_lock", "_low", "_thread", "result")

    def __init__(self, function: Callable[[], Any]) -> None:
        self.result: Future[Any] = Future()
        self._function = function
        self._lock = threading.Lock()
        self._thread: int | None = None
        self._low = False

    def run(self) -> bool:
        """Run the function in this thread; return whether the thread still has its usual priority."""
        with self._lock:
            self._thread = threading.get_native_id()
        result, error = None, None
        try:
            result = self._function()
        except BaseException as raised:
            error = raised
        with self._lock:  # from here on another function may run in this thread
            self._thread = None
            usual = not self._low
        if error is None:
            self.result.set_result(result)
        else:
            self.result.set_exception(error)
        del self, result, error  # else a cycle: an error holds this frame, and everything that the function worked with
        return usual

    def lower(self, nice: int) -> None:
        """Give the thread a lower priority, where threads have priorities of their own and the function still runs."""
        with self._lock:
            if self._thread is not None:
                self._low = _go_behind(self._thread, nice) or self._low


class GateThreads:
    """Threads that are started where none is free.

    A priority that was lowered cannot be raised again without rights. Such a thread ends with its function. Threads do
    not keep the process: one that indexes a map cannot be interrupted.

    Parameters
    ----------
    name : str
    nice : int
        By how much all of them go behind other threads.
    """

    def __init__(self, name: str, nice: int = 0) -> None:
        self._name = name
        self._nice = nice
        self._waiting: queue.SimpleQueue[Running | None] = queue.SimpleQueue()
        self._free = threading.Semaphore(0)
        self._closed = False

    def start(self, function: Callable[[], Any]) -> Running:
        """Run a function in a free thread, or in a new one.

        Raises
        ------
        RuntimeError
            When the threads are closed, or the system has no more.
        """
        if self._closed:
            raise RuntimeError("these threads are closed")
        running = Running(function)
        if not self._free.acquire(blocking=False):
            threading.Thread(target=self._work, name=self._name, daemon=True).start()
        self._waiting.put(running)
        return running

    def close(self) -> None:
        """End the free threads; does not wait for the others, which end with their functions."""
        self._closed = True
        while self._free.acquire(blocking=False):
            self._waiting.put(None)

    def _work(self) -> None:
        if self._nice:
            _go_behind(threading.get_native_id(), self._nice)
        while (running := self._waiting.get()) is not None:
            usual = running.run()
            del running
            if not usual or self._closed:
                return
            self._free.release()


def _go_behind(thread: int, nice: int) -> bool:
    """Give a thread a lower priority where threads have priorities of their own; return whether they have."""
    if sys.platform != "linux":
        return False
    with suppress(OSError):  # it has ended
        os.setpriority(os.PRIO_PROCESS, thread, os.getpriority(os.PRIO_PROCESS, thread) + nice)
    return True
