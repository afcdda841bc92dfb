"""The process: uvicorn with limits, and an end within ten seconds of SIGTERM."""

from __future__ import annotations

import asyncio
import gc
import logging
import os
import signal
import socket
import sys
import threading
from pathlib import Path
from types import FrameType

import uvicorn

from ..app import create_app
from ..runtime import Runtime
from ..settings import Settings
from .listening import BACKLOG
from .memory import return_large_blocks
from .part import Part
from .protocol import protocol_of

logger = logging.getLogger("linefix")
# What a search thread waits for Python's global lock, each of the many times that it comes back from a kernel, while
# the event loop is busy; by default it is 5 ms.
SWITCH_SECONDS = 0.001
GARBAGE = (20_000, 10, 10)  # little of what a request makes is cyclic; by default Python looks after each 700 objects
GRACE = 6  # s for requests that run when the doors close
TICKS = 10  # a second, of uvicorn's main loop
LAST_CALL = 9.5  # s after the signal the process ends whatever still runs


class DrainingServer(uvicorn.Server):
    """Says for a while that it is no longer ready, then closes its doors, finishes, and ends with status 0."""

    def __init__(self, config: uvicorn.Config, runtime: Runtime) -> None:
        super().__init__(config)
        self._runtime = runtime
        self._loop: asyncio.AbstractEventLoop | None = None

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Start, and know the loop that the end is to be arranged in."""
        self._loop = asyncio.get_running_loop()
        await super().startup(sockets)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Begin to drain; a second signal ends the process at once."""
        if self._runtime.draining or self._loop is None:
            self.should_exit = True
            self.force_exit = True
            return
        self._runtime.draining = True
        self._loop.call_soon_threadsafe(self._drain, self._loop)
        # In a thread of its own: it comes even when the loop hangs.
        last = threading.Timer(LAST_CALL, os._exit, (1,))
        last.daemon = True
        last.start()

    def _drain(self, loop: asyncio.AbstractEventLoop) -> None:
        seconds = self._runtime.settings.drain_seconds
        loop.call_later(seconds, self._close_doors)
        loop.call_later(seconds + GRACE, self._runtime.gate.cancel_all)

    def _close_doors(self) -> None:
        self.should_exit = True


class WorkerServer(DrainingServer):
    """One of several: Ctrl-C reaches them all, and is for the process above them to pass on."""

    def __init__(self, config: uvicorn.Config, runtime: Runtime, sign_of_life: Path) -> None:
        super().__init__(config, runtime)
        self._sign_of_life = sign_of_life

    async def on_tick(self, counter: int) -> bool:
        """Show every second that the event loop turns."""
        if counter % TICKS == 0:
            self._sign_of_life.touch()
        return await super().on_tick(counter)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Begin to drain when the process above says so."""
        if sig != signal.SIGINT:
            super().handle_exit(sig, frame)


def answer(settings: Settings, listener: socket.socket, part: Part, sign_of_life: Path | None = None) -> int:
    """Answer requests in this process until a signal comes; does not return when it could not be ended cleanly.

    One of several workers has a `sign_of_life`: a file that it touches every second while its event loop turns.
    """
    return_large_blocks()
    sys.setswitchinterval(SWITCH_SECONDS)
    gc.set_threshold(*GARBAGE)
    app = create_app(settings, part)
    runtime: Runtime = app.state.runtime
    config = uvicorn.Config(
        app,
        http=protocol_of(runtime.doors, settings.request_timeout),
        ws="none",
        lifespan="on",
        log_config=None,
        access_log=False,
        proxy_headers=False,
        server_header=False,
        timeout_keep_alive=15,
        timeout_graceful_shutdown=GRACE + 1,
        backlog=BACKLOG,
    )
    server = WorkerServer(config, runtime, sign_of_life) if sign_of_life else DrainingServer(config, runtime)
    server.run([listener])
    if runtime.gate.running:
        # A thread that indexes a map cannot be interrupted, and Python would wait for it.
        logging.shutdown()
        os._exit(0)
    return 0
