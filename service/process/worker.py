"""A worker process: its part of the service, its application, and when it ends itself."""

from __future__ import annotations

import asyncio
import faulthandler
import gc
import logging
import multiprocessing
import os
import signal
import sys
import threading
import time
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING

from filelock import FileLock, Timeout

from ..memory import return_large_blocks
from ..part import Part
from ..settings import Settings
from ..telemetry.metrics import forget_worker, share_counts
from .draining import drain_on_notice
from .listening import most_connections

if TYPE_CHECKING:
    from fastapi import FastAPI

    from ..http.services import Services

logger = logging.getLogger("linefix")
# For which a search thread waits for Python's global lock while the event loop is busy, each time that it returns from
# a kernel; by default it is 5 ms.
SWITCH_SECONDS = 0.001
GARBAGE = (20_000, 10, 10)  # few objects of a request are cyclic; by default Python looks after each 700 objects
LOOK_SECONDS = 1.0  # between looks whether the event loop turns


def build_worker(settings: Settings, directory: Path) -> FastAPI:
    """Prepare this process as a worker, and return its application; called by the server in the worker.

    Parameters
    ----------
    settings : Settings
    directory : Path
        For the locks of the parts, and for the counts that several workers share.
    """
    gc.disable()  # until the service is ready
    part, lock = take_part(directory, settings.workers)
    if settings.workers > 1:
        forget_worker(str(directory), part.index)  # the running requests of a dead one; its counts stay
        share_counts(str(directory), part.index)
    _end_with_supervisor()
    most_connections(settings.max_connections)
    # Imported here: the supervisor imports this module, and needs neither Numba nor SciPy.
    from ..app import create_app

    return_large_blocks()
    sys.setswitchinterval(SWITCH_SECONDS)
    gc.set_threshold(*GARBAGE)
    app = create_app(settings, part, _look_after)
    app.state.part = lock  # held as long as this process lives
    return app


def _look_after(services: Services) -> None:
    """Have the application drain at the supervisor's notice, and its event loop watched."""
    loop = asyncio.get_running_loop()
    drain_on_notice(services, loop)
    watch_loop(loop, services.settings.hang_s)


def take_part(directory: Path, workers: int) -> tuple[Part, FileLock]:
    """Return the first part that no worker has, and its lock; the system takes the lock from a process that dies.

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


def _end_with_supervisor() -> None:
    """End when the supervisor has ended, however that came."""
    supervisor = multiprocessing.parent_process()
    if supervisor is None:
        return

    def follow() -> None:
        supervisor.join()
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=follow, daemon=True).start()


def watch_loop(loop: asyncio.AbstractEventLoop, seconds: float) -> None:
    """End this process when its event loop stands still; the supervisor starts another.

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
