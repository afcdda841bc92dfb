"""The process: uvicorn with limits, and an end within ten seconds of SIGTERM."""

from __future__ import annotations

import logging
import os
import threading
from types import FrameType

import uvicorn

from .app import create_app
from .logs import configure
from .protocol import protocol_with_timeout
from .runtime import Runtime
from .settings import Settings

logger = logging.getLogger("linefix")
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


def serve(settings: Settings) -> None:
    """Run until a signal comes."""
    configure(settings.log_level)
    app = create_app(settings)
    config = uvicorn.Config(
        app,
        host=settings.host,
        port=settings.port,
        http=protocol_with_timeout(settings.head_timeout),
        ws="none",
        lifespan="on",
        log_config=None,
        access_log=False,
        server_header=False,
        timeout_keep_alive=15,
        timeout_graceful_shutdown=GRACE + 1,
        h11_max_incomplete_event_size=32_768,
        backlog=512,
    )
    DrainingServer(config, app.state.runtime).run()


def _later(seconds: float, call: object) -> None:
    assert callable(call)
    timer = threading.Timer(seconds, call)
    timer.daemon = True
    timer.start()


def _end() -> None:
    os._exit(1)
