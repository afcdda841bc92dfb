"""The process that serves: uvicorn with limits, and an end within ten seconds of SIGTERM."""

from __future__ import annotations

import asyncio
import gc
import logging
import math
import os
import signal
import socket
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

import uvicorn

from ..memory import return_large_blocks
from ..part import WHOLE, Part
from ..settings import Settings
from ..telemetry.logs import log_config
from .draining import GRACE, drain_on_signals
from .listening import BACKLOG

if TYPE_CHECKING:
    from fastapi import FastAPI

PROTOCOL = "service.process.protocol:AdmittingProtocol"  # by name: whoever only supervises need not load it
# What a search thread waits for Python's global lock, each of the many times that it comes back from a kernel, while
# the event loop is busy; by default it is 5 ms.
SWITCH_SECONDS = 0.001
GARBAGE = (20_000, 10, 10)  # little of what a request makes is cyclic; by default Python looks after each 700 objects
IDLE_SECONDS = 15  # after which a connection without a request is closed


def serve_alone(settings: Settings, listener: socket.socket) -> int:
    """Answer requests in this process until a signal comes; return the status to exit with.

    Does not return when a search still runs: a thread that indexes a map cannot be interrupted, and Python would wait
    for it.
    """
    config = config_of(settings, partial(build, settings, WHOLE))
    for number in (signal.SIGINT, signal.SIGTERM):
        # When it has ended well uvicorn raises the signal again, for handlers that were there before.
        signal.signal(number, lambda *_: None)
    uvicorn.Server(config).run([listener])
    if config.loaded_app.state.services.working:
        logging.shutdown()
        os._exit(0)
    return 0


def config_of(settings: Settings, factory: Callable[[], FastAPI]) -> uvicorn.Config:
    """Return how uvicorn is to run what a factory makes; the factory is called in the process that serves."""
    return uvicorn.Config(
        factory,
        factory=True,
        http=PROTOCOL,
        ws="none",
        lifespan="on",
        log_config=log_config(settings.log_level),
        access_log=False,
        proxy_headers=False,
        server_header=False,
        ssl_certfile=settings.tls_cert,
        ssl_keyfile=settings.tls_key,
        headers=[("X-Content-Type-Options", "nosniff")],
        workers=settings.workers,
        timeout_keep_alive=IDLE_SECONDS,
        timeout_graceful_shutdown=GRACE + 1,
        timeout_worker_healthcheck=math.ceil(settings.hang_seconds),
        backlog=BACKLOG,
    )


def build(settings: Settings, part: Part) -> FastAPI:
    """Prepare this process, and return the application; called by uvicorn in its event loop."""
    gc.disable()  # until the service is ready
    # Imported here: the supervisor imports this module, and needs neither Numba nor SciPy.
    from ..app import create_app

    return_large_blocks()
    _share_cores()
    sys.setswitchinterval(SWITCH_SECONDS)
    gc.set_threshold(*GARBAGE)
    app = create_app(settings, part)
    drain_on_signals(app.state.services, asyncio.get_running_loop())
    return app


def _share_cores() -> None:
    """Have the system not interrupt a search for each packet that comes; Linux only.

    To be woken for each by itself, away from a search, costs several times what it takes to refuse it. In this class a
    thread that wakes up waits for the one that runs to come to the end of its slice, a few milliseconds, and then the
    event loop hears all who came meanwhile in one go.
    """
    if hasattr(os, "SCHED_BATCH"):
        with suppress(OSError):  # where a sandbox does not let it
            os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))
