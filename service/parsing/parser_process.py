"""A process of its own for parsing large bodies.

Parsing 15 MB of JSON holds Python's global lock for a fifth of a second in one piece. Nothing else of the service would
answer meanwhile, probes included. The results are arrays, which cross as bytes. The memory that a hostile body may take
is taken there, too.
"""

from __future__ import annotations

import gc
import os
import pickle
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from ..memory import return_large_blocks
from .errors import ParserEndedError

T = TypeVar("T")
LARGE = 100_000  # bytes; parsing more would hold up everything else for some milliseconds
NICE = 5  # searches go before it, at three times as much of a core that both want
END_SECONDS = 1.0
# By `python -m` what stands in the working folder would come first: another checkout, or anybody's `service.py`.
PROGRAM = "import runpy, sys; sys.path[:] = {path!r}; runpy.run_module({module!r}, run_name='__main__', alter_sys=True)"


class ParserProcess:
    """Runs functions in one other process, one at a time; safe to use from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None

    @property
    def pid(self) -> int | None:
        """The process's id, None while there is none."""
        return None if self._process is None else self._process.pid

    def start(self) -> None:
        """Start the process, if there is none."""
        with self._lock:
            self._started()

    def call(self, function: Callable[..., T], *arguments: Any) -> T:
        """Return the result of a module's function there, or raise its exception.

        Bytes among the arguments, and in a tuple that comes back, are not copied on the way.

        Raises
        ------
        ParserEndedError
            When the process ends meanwhile; the next call has a new one.
        """
        with self._lock:
            try:
                connection = self._started()
                send(connection, (function, *map(_wrapped, arguments)))
                found, error = receive(connection)
            except (OSError, EOFError):
                self._end()
                raise ParserEndedError from None
        if error is not None:
            raise error
        answer: T = found
        return answer

    def close(self) -> None:
        """End the process; its present work is lost."""
        process = self._process
        if process is not None:
            process.kill()
        with self._lock:
            self._end()

    def _started(self) -> Connection:
        if self._process is not None and self._process.poll() is not None:
            self._end()
        if self._connection is None:
            ours, theirs = socket.socketpair()
            with theirs:
                # In a group of its own, so that Ctrl-C is for the service, which then ends this.
                try:
                    self._process = subprocess.Popen(
                        command_of(__name__, str(theirs.fileno())),
                        pass_fds=[theirs.fileno()],
                        process_group=0,
                        stdin=subprocess.DEVNULL,
                    )
                except OSError:  # no memory, or no descriptors
                    ours.close()
                    raise
            self._connection = Connection(ours.detach())
        return self._connection

    def _end(self) -> None:
        if self._connection is not None:
            self._connection.close()
        if self._process is not None:
            self._process.kill()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(END_SECONDS)
        self._process = self._connection = None


def command_of(module: str, *arguments: str) -> list[str]:
    """Return the command of a process that runs a module, which imports from where this process does."""
    return [sys.executable, "-c", PROGRAM.format(path=sys.path, module=module), *arguments]


def send(connection: Connection, value: Any) -> None:
    """Send an object; arrays, and bytes that are wrapped in a `pickle.PickleBuffer`, are not copied on the way.

    `multiprocessing` sends a pickle, which holds a copy of every array and of the whole body.

    Raises
    ------
    OSError
        When the other end is gone.
    """
    buffers: list[pickle.PickleBuffer] = []
    head = pickle.dumps(value, protocol=5, buffer_callback=buffers.append)
    connection.send(len(buffers))
    connection.send_bytes(head)
    for buffer in buffers:
        connection.send_bytes(buffer.raw())


def receive(connection: Connection) -> Any:
    """Wait for an object from a trusted sender, since it comes as a pickle.

    A `bytearray` arrives as `bytes`, and arrays cannot be written to.

    Raises
    ------
    OSError, EOFError
        When the other end is gone.
    """
    count = connection.recv()
    head, *buffers = [connection.recv_bytes() for _ in range(count + 1)]
    return pickle.loads(head, buffers=buffers)


def _wrapped(value: object) -> object:
    return pickle.PickleBuffer(value) if isinstance(value, bytes | bytearray) else value


def work(connection: Connection) -> None:
    """Answer calls until the other end is gone, which it also is when the service was killed."""
    return_large_blocks()
    os.nice(NICE)
    gc.disable()  # parsed JSON has no cycles, and looking for them takes longer than parsing
    while True:
        found: Any = None
        error: Exception | None = None
        try:
            function, *arguments = receive(connection)
        except (EOFError, OSError):
            return
        try:
            found = function(*arguments)
        except Exception as raised:
            error = raised
        if isinstance(found, tuple):
            found = tuple(map(_wrapped, found))
        try:
            send(connection, (found, error))
        except OSError:
            return
        function = arguments = found = error = None  # nothing large is held while this waits


if __name__ == "__main__":
    work(Connection(int(sys.argv[1])))
