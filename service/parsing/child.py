"""A child process that works for the service within bounds: it parses large bodies, or reads files of unknown senders.

Parsing 15 MB of JSON holds Python's global lock for a fifth of a second in one piece. Nothing else of the service would
answer meanwhile, probes included. The memory that a hostile body may take is taken in the child, too.

One child parses all large bodies, since to start one takes longer than to parse. Its results are arrays, which cross as
bytes. Each import has a child of its own, which never holds data of another request, and whose answer is bytes: a
pickle of it could run anything in the service.
"""

from __future__ import annotations

import gc
import os
import pickle
import resource
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, TypeVar

import orjson

from ..errors import ParserEndedError
from ..memory import return_large_blocks

T = TypeVar("T")
LARGE = 100_000  # bytes of JSON; parsing more would hold up everything else for some milliseconds
NICE = 5  # searches go before it, at three times as much of a core that both want
END_SECONDS = 1.0
LOOK_SECONDS = 0.05  # between two looks whether anybody waits
MAPPED_BYTES = 1_000_000_000  # of address space in addition to the memory: libraries, and room that is never used
MOST_OPEN = 64  # files
# Variables of the environment for the service alone: keys, their paths, passwords of databases.
PRIVATE = ("LINEFIX_", "PG")
SHARED = ("LINEFIX_KERNELS",)
# By `python -m` what stands in the working folder would come first: another checkout, or anybody's `service.py`.
PROGRAM = "import sys; sys.path[:] = {path!r}; from service.parsing import child; child.main(*sys.argv[1:])"


@dataclass(frozen=True, slots=True)
class ChildBounds:
    """Bounds of a child; None: of no concern.

    Attributes
    ----------
    memory_bytes : int
    cpu_seconds : int, or None
        Of a processor, in its whole life.
    file_bytes : int, or None
        Of one file that it writes.
    seconds : float, or None
        Of one call.
    answer_bytes : int, or None
        Of its answer, which is bytes then; None where it is trusted with any object.
    """

    memory_bytes: int
    cpu_seconds: int | None = None
    file_bytes: int | None = None
    seconds: float | None = None
    answer_bytes: int | None = None


PARSING = ChildBounds(1_000_000_000, seconds=30.0)
"""Far more than the largest body takes."""


class Child:
    """Runs functions in one other process, one at a time; safe to use from several threads.

    Parameters
    ----------
    bounds : ChildBounds
    folder : Path or None
        For its temporary files; it removes the folder when the service was killed.
    """

    def __init__(self, bounds: ChildBounds = PARSING, folder: Path | None = None) -> None:
        self._bounds = bounds
        self._folder = folder
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None

    @property
    def pid(self) -> int | None:
        """The process's id, None while there is none."""
        return None if self._process is None else self._process.pid

    def call(self, function: Callable[..., T], *arguments: Any, ends: Callable[[], bool] = lambda: False) -> T:
        """Return the result of a module's function there, or raise its exception.

        Bytes among the arguments, and in a tuple that comes back, are not copied on the way. The process is killed when
        `ends` returns true.

        Raises
        ------
        ParserEndedError
            When the process ends meanwhile; the next call has a new one.
        """
        with self._lock:
            try:
                found, error = self._answer((function, *map(_wrapped, arguments)), ends)
            except (OSError, EOFError):
                raise ParserEndedError(self._end()) from None
        try:
            if error is not None:
                raise error
        finally:
            del error  # its traceback holds this frame: in a cycle, the body would stay until the next collection
        answer: T = found
        return answer

    def close(self) -> None:
        """End the process; its present work is lost."""
        process = self._process
        if process is not None:
            process.kill()
        with self._lock:
            self._end()

    def _answer(self, task: object, ends: Callable[[], bool]) -> tuple[Any, Exception | None]:
        bounds = self._bounds
        most = None if bounds.seconds is None else time.monotonic() + bounds.seconds
        connection = self._started()
        send(connection, task)
        while not connection.poll(LOOK_SECONDS):
            if ends() or (most is not None and time.monotonic() > most):
                self._kill()
                raise EOFError
        if bounds.answer_bytes is not None:
            return connection.recv_bytes(bounds.answer_bytes), None
        found, error = receive(connection)
        return found, error

    def _started(self) -> Connection:
        if self._process is not None and self._process.poll() is not None:
            self._end()
        if self._connection is None:
            ours, theirs = socket.socketpair()
            files = "" if self._folder is None else str(self._folder)
            told = orjson.dumps(asdict(self._bounds)).decode()
            with theirs:
                try:
                    self._process = subprocess.Popen(
                        [sys.executable, "-c", PROGRAM.format(path=sys.path), str(theirs.fileno()), told, files],
                        env=_environment(self._folder),
                        pass_fds=[theirs.fileno()],
                        process_group=0,  # so that Ctrl-C is for the service, which then ends this
                        stdin=subprocess.DEVNULL,
                        # Libraries may print parts of the files of unknown senders: not into the log.
                        stderr=None if self._folder is None else subprocess.DEVNULL,
                    )
                except OSError:  # no memory, or no descriptors
                    ours.close()
                    raise
            self._connection = Connection(ours.detach())
        return self._connection

    def _kill(self) -> None:
        if self._process is not None:
            self._process.kill()

    def _end(self) -> int | None:
        """End the process; return its status, None where there was none."""
        status = None
        if self._connection is not None:
            self._connection.close()
        if self._process is not None:
            for patience in (END_SECONDS / 5, 10 * END_SECONDS):  # a process that ended by itself has its status soon
                with suppress(subprocess.TimeoutExpired):
                    status = self._process.wait(patience)
                    break
                self._kill()
        self._process = self._connection = None
        return status


def _environment(folder: Path | None) -> dict[str, str]:
    told = {name: os.environ[name] for name in os.environ if name in SHARED or not name.upper().startswith(PRIVATE)}
    return told if folder is None else {**told, "TMPDIR": str(folder)}


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


def _bind(bounds: ChildBounds) -> None:
    """Take away from this process all that it does not need."""
    for what, most in (
        (resource.RLIMIT_DATA, bounds.memory_bytes),
        (resource.RLIMIT_AS, bounds.memory_bytes + MAPPED_BYTES),
        (resource.RLIMIT_CPU, bounds.cpu_seconds),
        (resource.RLIMIT_FSIZE, bounds.file_bytes),
        (resource.RLIMIT_NOFILE, MOST_OPEN),
        (resource.RLIMIT_CORE, 0),
    ):
        if most is not None:
            with suppress(ValueError, OSError):  # less is allowed already, or the system has no such limit
                resource.setrlimit(what, (most, most))
    with suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000")  # the first to go where the machine's memory ends


def work(connection: Connection, *, untrusted: bool) -> None:
    """Answer calls until the other end is gone, which it also is when the service was killed."""
    if not untrusted:
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
        except MemoryError:
            return
        except Exception as raised:
            error = raised
        if isinstance(found, tuple):
            found = tuple(map(_wrapped, found))
        try:
            if untrusted:
                connection.send_bytes(found)
            else:
                send(connection, (found, error))
        except OSError:
            return
        function = arguments = found = error = None  # nothing large is held while this waits


def main(descriptor: str, told: str, folder: str) -> None:
    """Work until the service ends the connection, or is killed: then its files are removed here."""
    bounds = ChildBounds(**orjson.loads(told))
    return_large_blocks()
    os.nice(NICE)
    _bind(bounds)
    try:
        work(Connection(int(descriptor)), untrusted=bounds.answer_bytes is not None)
    finally:
        if folder:
            shutil.rmtree(folder, ignore_errors=True)
