"""A process of its own for parsing what is large.

Parsing 15 MB of JSON holds Python's global lock for a fifth of a second in one piece: nothing else of the service would
answer meanwhile, probes included. What comes back are arrays, which cross as bytes. The memory that a hostile body may
take is taken there, too.
"""

from __future__ import annotations

import gc
import multiprocessing
import signal
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from .memory import return_large_blocks
from .problems import ProblemError

T = TypeVar("T")
END_SECONDS = 1.0


class ParserProcess:
    """Runs functions in one other process, one at a time; safe to use from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None

    @property
    def pid(self) -> int | None:
        """The process's id, None while there is none."""
        return None if self._process is None else self._process.pid

    def start(self) -> None:
        """Start the process, if there is none."""
        with self._lock:
            self._started()

    def call(self, function: Callable[..., T], *arguments: Any) -> T:
        """Return what a function of a module returns there, or raise what it raises.

        Raises
        ------
        ProblemError
            When the process ends meanwhile; the next call has a new one.
        """
        with self._lock:
            pipe = self._started()
            try:
                pipe.send((function, arguments))
                returned, answer = pipe.recv()
            except (OSError, EOFError):
                self._end()
                raise ProblemError("overloaded", "the process that parses large bodies has ended") from None
        if returned:
            found: T = answer
            return found
        raise answer

    def close(self) -> None:
        """End the process; what it works at is lost."""
        process = self._process
        if process is not None:
            process.kill()
        with self._lock:
            self._end()

    def _started(self) -> Connection:
        if self._process is not None and not self._process.is_alive():
            self._end()
        if self._pipe is None:
            # Spawned: a fork would copy the locks of threads that it does not have.
            context = multiprocessing.get_context("spawn")
            self._pipe, theirs = context.Pipe()
            self._process = context.Process(target=_work, args=(theirs,), name="linefix-parser", daemon=True)
            self._process.start()
            theirs.close()
        return self._pipe

    def _end(self) -> None:
        if self._pipe is not None:
            self._pipe.close()
        if self._process is not None:
            self._process.kill()
            self._process.join(END_SECONDS)
        self._process = self._pipe = None


def _work(pipe: Connection) -> None:
    """Answer calls until the other end is gone, which it also is when the service was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the service, which then ends this
    return_large_blocks()
    gc.disable()  # parsed JSON has no cycles, and looking for them takes longer than parsing
    while True:
        try:
            function, arguments = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            answer = True, function(*arguments)
        except Exception as error:
            answer = False, error
        try:
            pipe.send(answer)
        except OSError:
            return
        del function, arguments, answer
