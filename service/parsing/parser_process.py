"""A process of its own for parsing what is large.

Parsing 15 MB of JSON holds Python's global lock for a fifth of a second in one piece: nothing else of the service would
answer meanwhile, probes included. What comes back are arrays, which cross as bytes. The memory that a hostile body may
take is taken there, too.
"""

from __future__ import annotations

import gc
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

from ..http.problems import ProblemError
from ..process.memory import return_large_blocks
from .channel import Channel

T = TypeVar("T")
END_SECONDS = 1.0
COMMAND = "import sys; sys.path[:] = {path!r}; from service.parsing.parser_process import work; work({end})"


class ParserProcess:
    """Runs functions in one other process, one at a time; safe to use from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._channel: Channel | None = None

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
            channel = self._started()
            try:
                channel.send((function, *arguments))
                kind, *answer = channel.receive()
            except (OSError, EOFError):
                self._end()
                raise ProblemError("overloaded", "the process that parses large bodies has ended") from None
        if kind is Exception:
            raise answer[0]
        found: T = tuple(answer) if kind is tuple else answer[0]  # type: ignore[assignment]
        return found

    def close(self) -> None:
        """End the process; what it works at is lost."""
        process = self._process
        if process is not None:
            process.kill()
        with self._lock:
            self._end()

    def _started(self) -> Channel:
        if self._process is not None and self._process.poll() is not None:
            self._end()
        if self._channel is None:
            # Not by multiprocessing, which keeps one more process beside each that it starts. In a group of its own, so
            # that Ctrl-C is for the service, which then ends this.
            ours, theirs = socket.socketpair()
            with theirs:
                command = COMMAND.format(path=sys.path, end=theirs.fileno())
                self._process = subprocess.Popen(
                    [sys.executable, "-c", command],
                    pass_fds=[theirs.fileno()],
                    process_group=0,
                    stdin=subprocess.DEVNULL,
                )
            self._channel = Channel(ours)
        return self._channel

    def _end(self) -> None:
        if self._channel is not None:
            self._channel.close()
        if self._process is not None:
            self._process.kill()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(END_SECONDS)
        self._process = self._channel = None


def work(end: int) -> None:
    """Answer calls until the other end is gone, which it also is when the service was killed."""
    channel = Channel(socket.socket(fileno=end))
    return_large_blocks()
    gc.disable()  # parsed JSON has no cycles, and looking for them takes longer than parsing
    while True:
        try:
            function, *arguments = channel.receive()
        except (EOFError, OSError):
            return
        answer: tuple[Any, ...]
        try:
            found = function(*arguments)
            answer = (tuple, *found) if isinstance(found, tuple) else (object, found)
        except Exception as error:
            answer = Exception, error
        try:
            channel.send(answer)
        except OSError:
            return
        function = arguments = found = answer = None  # type: ignore[assignment]
