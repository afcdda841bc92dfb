"""Several worker processes on one port, under uvicorn's supervisor.

It starts them, replaces those that die or do not answer, and passes signals on. What it does not know is here: which
share of the service each of them is, that their counts are one, that one stands still though it answers, and that they
end in time.
"""

from __future__ import annotations

import asyncio
import faulthandler
import logging
import multiprocessing
import os
import signal
import socket
import tempfile
import threading
import time
from contextlib import suppress
from functools import partial
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from filelock import FileLock, Timeout
from uvicorn.supervisors import Multiprocess

from ..database_file import file_of
from ..maps.database import DatabaseFile
from ..maps.errors import StoreError
from ..part import Part
from ..settings import Settings
from ..telemetry.metrics import forget_worker, share_counts
from .server import build, config_of

if TYPE_CHECKING:
    from fastapi import FastAPI

logger = logging.getLogger("linefix")
ALL_ENDED = 9.8  # s after the signal whoever is left is killed
LOOK_SECONDS = 1.0  # between looks whether the event loop turns
ENDED_AS_TOLD = (-signal.SIGTERM, -signal.SIGINT, -signal.SIGHUP)  # a worker that was still starting


class Supervisor(Multiprocess):
    """Keeps as many workers as are set."""

    def join_all(self) -> None:
        """Wait for all to end; kill who has not in time."""
        last = time.monotonic() + ALL_ENDED
        for process in self.processes:
            process.process.join(max(0.0, last - time.monotonic()))
            if process.exitcode is None:
                process.process.kill()
        super().join_all()

    def keep_subprocess_alive(self) -> None:
        """Replace those that died or do not answer.

        A worker's end of the pipe on which it is asked is closed here: one that dies while it is asked is then known to
        be dead at once, and not when its time to answer is over.
        """
        for process in self.processes:
            process.child_conn.close()
        super().keep_subprocess_alive()

    def handle_hup(self) -> None:
        """End as at SIGTERM; by itself it would start all workers anew, each of which has had the signal, too."""
        self.handle_term()

    @property
    def status(self) -> int:
        """The status to exit with: 0 when all ended as they were told."""
        return int(any(process.exitcode not in (0, *ENDED_AS_TOLD) for process in self.processes))


def supervise(settings: Settings, listener: socket.socket) -> int:
    """Run workers until a signal comes; return the status to exit with.

    The file of the maps is made before any of them runs: one that still starts when it is moved away must not make it
    anew.
    """
    path = file_of(settings.url)
    if path is not None:
        with suppress(StoreError):  # the first worker tries again, and says what is wrong
            DatabaseFile(path, may_make=True).require()
    # Counts live in memory where there is a file system for that; nothing else need be writable.
    shared = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(prefix="linefix-workers-", dir=shared) as directory:
        supervisor = Supervisor(config_of(settings, partial(build_worker, settings, Path(directory))), [listener])
        supervisor.run()
        return supervisor.status


def build_worker(settings: Settings, directory: Path) -> FastAPI:
    """Make this process one of several, and return its application; called by uvicorn in its event loop."""
    part, lock = take_part(directory, settings.workers)
    forget_worker(str(directory), part.index)  # what a dead one had running; its counts stay
    share_counts(str(directory), part.index)
    _follow_parent()
    app = build(settings, part)
    app.state.part = lock  # held as long as this process lives
    watch_loop(asyncio.get_running_loop(), settings.hang_seconds)
    return app


def take_part(directory: Path, workers: int) -> tuple[Part, FileLock]:
    """Return the first part that nobody has, and the lock that says so; the system takes it from whoever dies.

    A worker replaces another when it takes a part that was in use before, and when it comes while all parts are taken:
    workers that are exchanged start before the old ones end.
    """
    for index in count():
        path = directory / f"worker-{index}"
        replaces = path.exists() or index >= workers
        lock = FileLock(path)
        try:
            lock.acquire(blocking=False)
        except Timeout:
            continue
        return Part(index, workers, replaces), lock
    raise AssertionError


def _follow_parent() -> None:
    """End when the process above has ended, however that came."""
    above = multiprocessing.parent_process()
    assert above is not None

    def follow() -> None:
        above.join()
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=follow, daemon=True).start()


def watch_loop(loop: asyncio.AbstractEventLoop, seconds: float) -> None:
    """End this process when its event loop stands still; uvicorn only sees whether any of its threads answers.

    Looks are counted, not seconds: a process that was suspended for a while is not taken for one that hangs.
    """
    turned = threading.Event()

    def watch() -> None:
        silent = 0.0
        while silent < seconds:
            turned.clear()
            try:
                loop.call_soon_threadsafe(turned.set)
            except RuntimeError:  # it has ended
                return
            time.sleep(LOOK_SECONDS)
            silent = 0.0 if turned.is_set() else silent + LOOK_SECONDS
        logger.error("the event loop hangs")
        faulthandler.dump_traceback()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
