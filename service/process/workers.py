"""Several worker processes on one port: started, replaced when they die or hang, and ended together.

uvicorn has a supervisor of its own, which builds its own servers: ours drain, count into shared files, and are ready
before they take the place of a dead one.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import socket
import tempfile
import threading
import time
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path

from uvicorn.config import STARTUP_FAILURE

from ..settings import Settings
from ..telemetry.logs import configure
from ..telemetry.metrics import forget_worker, share_counts
from .part import Part

logger = logging.getLogger("linefix")
ALL_ENDED = 9.8  # s after the signal whoever is left is killed
SHORT_LIFE = 10.0  # s; who lives no longer again and again is started again ever later
LONGEST_PAUSE = 30.0  # s
LOOK_SECONDS = 1.0  # between looks at the signs of life
LONGEST_START = 300  # looks without a first sign of life; kernels may have to be compiled


class Workers:
    """Keeps as many workers as are set.

    Parameters
    ----------
    settings : Settings
    listener : socket.socket
        They all accept connections from it; it stays open while any of them is being replaced.
    """

    def __init__(self, settings: Settings, listener: socket.socket) -> None:
        self._settings = settings
        self._listener = listener
        self._context = multiprocessing.get_context("spawn")
        self._processes: dict[int, BaseProcess] = {}
        self._started: dict[int, float] = {}
        self._short_lives: dict[int, int] = {}
        self._due: dict[int, float] = {}
        self._signs: dict[int, int] = {}
        self._silent: dict[int, int] = {}
        self._looked = 0.0
        self._signals = 0
        self._status = 0

    def run(self) -> int:
        """Run until a signal comes; return the status to exit with."""
        # Counts live in memory where there is a file system for that; nothing else need be writable.
        shared = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, self._note)
        heard, woken = socket.socketpair()
        for end in (heard, woken):
            end.setblocking(False)
        signal.set_wakeup_fd(woken.fileno())
        with tempfile.TemporaryDirectory(prefix="linefix-metrics-", dir=shared) as directory:
            for index in range(self._settings.workers):
                self._start(directory, Part(index, self._settings.workers))
            while not self._signals:
                soonest = min(self._due.values(), default=float("inf")) - time.monotonic()
                timeout = min(LOOK_SECONDS, max(0.0, soonest))
                wait([heard, *(process.sentinel for process in self._processes.values())], timeout)
                self._kill_hung(Path(directory))
                self._replace_dead(directory)
            self._end_all(heard)
        return self._status

    def _note(self, number: int, frame: object) -> None:
        self._signals += 1

    def _start(self, directory: str, part: Part) -> None:
        self._signs[part.index] = self._silent[part.index] = 0
        sign_of_life(Path(directory), part.index).unlink(missing_ok=True)
        arguments = (self._settings, self._listener, part, directory)
        process = self._context.Process(target=_work, args=arguments, name=f"linefix-worker-{part.index}")
        process.start()
        self._processes[part.index] = process
        self._started[part.index] = time.monotonic()

    def _kill_hung(self, directory: Path) -> None:
        """Kill whose event loop shows no sign of life.

        Looks are counted, not seconds: when everything was stopped for a while it takes as many again.
        """
        if time.monotonic() - self._looked < LOOK_SECONDS:
            return
        self._looked = time.monotonic()
        for index, process in self._processes.items():
            try:
                sign = sign_of_life(directory, index).stat().st_mtime_ns
            except FileNotFoundError:
                sign = 0
            self._silent[index] = self._silent[index] + 1 if sign == self._signs[index] else 0
            self._signs[index] = sign
            if self._silent[index] * LOOK_SECONDS > (self._settings.hang_seconds if sign else LONGEST_START):
                logger.error("a worker hangs", extra={"worker": index})
                process.kill()
                process.join()

    def _replace_dead(self, directory: str) -> None:
        now = time.monotonic()
        for index, process in list(self._processes.items()):
            if process.is_alive():
                continue
            del self._processes[index]
            forget_worker(directory, index)
            if process.exitcode == STARTUP_FAILURE:
                logger.error("a worker cannot start")
                self._signals, self._status = 1, 1
                return
            short = now - self._started[index] < SHORT_LIFE
            self._short_lives[index] = self._short_lives.get(index, 0) + 1 if short else 0
            # The first time at once.
            pause = min(LONGEST_PAUSE, 2.0 ** (self._short_lives[index] - 2)) if self._short_lives[index] > 1 else 0.0
            self._due[index] = now + pause
            logger.error("a worker has died", extra={"worker": index, "exitcode": process.exitcode, "again_in": pause})
        for index in [index for index, due in self._due.items() if due <= now]:
            del self._due[index]
            self._start(directory, replace(Part(index, self._settings.workers), replaces=bool(self._processes)))

    def _end_all(self, heard: socket.socket) -> None:
        """Have them all drain; a second signal, or the end of the time, kills."""
        self._listener.close()
        self._signal_all(signal.SIGTERM)
        told, last = self._signals, time.monotonic() + ALL_ENDED
        while left := [process for process in self._processes.values() if process.is_alive()]:
            wait([heard, *(process.sentinel for process in left)], max(0.0, last - time.monotonic()))
            with suppress(BlockingIOError):
                heard.recv(64)
            if self._signals > told or time.monotonic() >= last:
                self._signal_all(signal.SIGKILL)
                self._status = 1
                told, last = self._signals, time.monotonic() + ALL_ENDED
        if any(process.exitcode for process in self._processes.values()):
            self._status = 1

    def _signal_all(self, number: int) -> None:
        for process in self._processes.values():
            if process.is_alive() and process.pid is not None:
                os.kill(process.pid, number)


def _work(settings: Settings, listener: socket.socket, part: Part, directory: str) -> None:
    """Be a worker; ends when the process above it has ended, however that came."""
    configure(settings.log_level)
    share_counts(directory, part.index)
    above = multiprocessing.parent_process()
    assert above is not None

    def follow() -> None:
        above.join()
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=follow, daemon=True).start()
    from .server import answer

    raise SystemExit(answer(settings, listener, part, sign_of_life(Path(directory), part.index)))


def sign_of_life(directory: Path, index: int) -> Path:
    """Return the file that a worker touches every second, from its event loop."""
    return directory / f"alive-{index}"
