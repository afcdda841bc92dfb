"""The server: Granian with the service's limits, its worker processes, and an end within ten seconds of SIGTERM.

Granian parses HTTP outside Python. It bounds heads in bytes, in fields and in time, reads one request of a connection
at a time, and starts a new worker where one has died.
"""

from __future__ import annotations

import logging
import multiprocessing
import os
import tempfile
from contextlib import suppress
from functools import partial
from pathlib import Path

from granian.constants import HTTPModes, Interfaces, Loops, SSLProtocols
from granian.http import HTTP1Settings
from granian.log import LogLevels
from granian.server import MPServer

from ..database_location import file_of
from ..maps.database import DatabaseFile
from ..maps.errors import StoreError
from ..settings import Settings
from ..telemetry.logs import log_config
from .draining import GRACE, drain_on_signals
from .listening import free_address, most_connections
from .worker import build_worker

logger = logging.getLogger("linefix")
BACKLOG = 512
MAX_HEAD = 32_768  # bytes that are read of a request's head
LONGEST_HEAD = 60_000  # ms; the longest that Granian takes for the time of a head


def serve(settings: Settings) -> int:
    """Run the workers until a signal comes; return the status to exit with.

    The file of the maps is made before any worker runs: one that still starts when it is moved away must not make it
    again.

    Raises
    ------
    OSError
        When the address is in use or does not belong to this machine.
    """
    host, port = free_address(settings)
    path = file_of(settings.url)
    if path is not None:
        with suppress(StoreError):  # the first worker tries again, and reports what is wrong
            DatabaseFile(path, may_make=True).require()
    multiprocessing.set_start_method("spawn", force=True)
    server = server_of(settings, host, port)
    server.on_startup(partial(drain_on_signals, settings.drain_s))
    server.on_startup(partial(logger.info, "listening", extra={"host": host, "port": port}))
    # Counts live in memory where there is a file system for that; nothing else need be writable.
    shared = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
    with tempfile.TemporaryDirectory(prefix="linefix-workers-", dir=shared) as directory:
        build = partial(build_worker, settings, Path(directory))
        try:
            server.serve(target_loader=build, wrap_loader=False)
        except SystemExit as ended:
            return int(ended.code or 0)
    return 0


def server_of(settings: Settings, host: str, port: int) -> MPServer:
    """Return the server on an address, with the settings' limits."""
    connections = most_connections(settings.max_connections)
    return MPServer(
        "service",
        address=host,
        port=port,
        interface=Interfaces.ASGI,
        workers=settings.workers,
        loop=Loops.uvloop,
        http=HTTPModes.http1,
        websockets=False,
        backlog=BACKLOG,
        backpressure=max(1, connections // settings.workers),
        http1_settings=HTTP1Settings(
            header_read_timeout=min(LONGEST_HEAD, int(1e3 * settings.request_timeout_s)), max_buffer_size=MAX_HEAD
        ),
        log_level=LogLevels.warning,
        log_dictconfig=log_config(settings.log_level),
        ssl_cert=settings.tls_cert,
        ssl_key=settings.tls_key,
        ssl_protocol_min=SSLProtocols.tls12,
        respawn_failed_workers=True,
        workers_kill_timeout=round(GRACE) + 1,
    )
