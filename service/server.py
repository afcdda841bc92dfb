"""The process: uvicorn with limits, and an end within ten seconds of SIGTERM."""

from __future__ import annotations

import gc
import logging
import os
import socket
import sys
import threading
from types import FrameType

import uvicorn

from .app import create_app
from .logs import configure
from .memory import return_large_blocks
from .protocol import prepare, protocol_of
from .runtime import Runtime
from .settings import Settings

logger = logging.getLogger("linefix")
BACKLOG = 512
# What a search thread waits for Python's global lock, each of the many times that it comes back from a kernel, while
# the event loop is busy; by default it is 5 ms.
SWITCH_SECONDS = 0.001
GARBAGE = (20_000, 10, 10)  # little of what a request makes is cyclic; by default Python looks after each 700 objects
GRACE = 6  # s for requests that run when the doors close
LAST_CALL = 9.5  # s after the signal the process ends whatever still runs


class DrainingServer(uvicorn.Server):
    """Says for a while that it is no longer ready, then closes its doors, finishes, and ends with status 0."""

    def __init__(self, config: uvicorn.Config, runtime: Runtime) -> None:
        super().__init__(config)
        self._runtime = runtime

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Begin to drain; a second signal ends the process at once."""
        if self._runtime.draining:
            self.should_exit = True
            self.force_exit = True
            return
        self._runtime.draining = True
        _later(self._runtime.settings.drain_seconds, self._close_doors)
        _later(self._runtime.settings.drain_seconds + GRACE, self._runtime.gate.cancel_all)
        _later(LAST_CALL, _end)

    def _close_doors(self) -> None:
        self.should_exit = True


def serve(settings: Settings) -> int:
    """Run until a signal comes; return the status to exit with."""
    configure(settings.log_level)
    return_large_blocks()
    sys.setswitchinterval(SWITCH_SECONDS)
    gc.set_threshold(*GARBAGE)
    try:
        listener = listen(settings)
    except OSError as error:
        logger.error("cannot listen on %s port %d: %s", settings.host, settings.port, error.strerror)
        return 1
    app = create_app(settings)
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
    DrainingServer(config, runtime).run([listener])
    return 0


def listen(settings: Settings) -> socket.socket:
    """Return a socket that listens on the address that is set.

    Raises
    ------
    OSError
        When the address is taken or is none of this machine's.
    """
    family, _, _, _, address = socket.getaddrinfo(settings.host, settings.port, type=socket.SOCK_STREAM)[0]
    listener = socket.create_server(address[:2], family=family, backlog=BACKLOG)
    prepare(listener, settings.request_timeout)
    host, port = listener.getsockname()[:2]
    logger.info("listening", extra={"host": host, "port": port})
    return listener


def _later(seconds: float, call: object) -> None:
    assert callable(call)
    timer = threading.Timer(seconds, call)
    timer.daemon = True
    timer.start()


def _end() -> None:
    os._exit(1)
