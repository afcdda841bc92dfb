"""``linefix serve`` and ``python -m service``."""

from __future__ import annotations

import asyncio
import errno
import gc
import json
import math
import os
import signal
import socket
import sys
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fastapi import FastAPI

    from .services import Services
    from .settings import Settings

# One search runs per core already: a second layer of threads in numpy's libraries would only get in its way. They read
# this when they are loaded, so before anything imports numpy.
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
# Failures of a disk that can be repaired while the service runs and reports that it is not ready.
AILING_DISK = (errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.EIO)
# Read by compiled.cache and by `cli`, which are not loaded here for these names.
MAX_HEAD = 32_768  # bytes that are kept of a head, of trailers, of a chunk's extension
GRACE = 6  # s after which a closing server cancels what still runs; a second earlier the application cancels searches
HANG = 30  # s without an answer after which one of several workers is replaced
# For which a search thread waits for Python's global lock while the event loop is busy, each time that it returns from
# a kernel; by default it is 5 ms.
SWITCH_SECONDS = 0.001
GARBAGE = (20_000, 10, 10)  # few objects of a request are cyclic; by default Python looks after each 700 objects
COUNTS = "PROMETHEUS_MULTIPROC_DIR"  # read by prometheus_client: the folder of the counts that workers share
EXTRA = ("fastapi", "fastapi_offline", "prometheus_client", "pydantic_settings", "sqlalchemy", "starlette", "uvicorn")
ARGUMENTS = "LINEFIX_ARGUMENTS"  # of the command line, from which each worker reads its settings again
NO_SETTINGS = ("LINEFIX_KERNELS", "LINEFIX_KEY", ARGUMENTS)


def serve(arguments: Sequence[str]) -> int:
    """Read the settings and run the service."""
    gc.disable()  # until the service is ready
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    try:
        from .settings import SettingsError, read_settings
    except ModuleNotFoundError as error:
        print(f"linefix: {needed(error)}", file=sys.stderr)
        return 2
    try:
        settings = read_settings(arguments)
    except SettingsError as error:
        print(f"linefix: {error}", file=sys.stderr)
        return 2
    for name in unknown_settings():
        print(f"linefix: {name} in the environment is not a setting", file=sys.stderr)
    os.environ[ARGUMENTS] = json.dumps([*arguments])
    return run(settings)


def needed(error: ModuleNotFoundError) -> str:
    """Return what to install where a package of the extra is missing."""
    return f'the service needs the package {error.name}: in a checkout, pip install ".[service]"'


def unknown_settings() -> list[str]:
    """Return what looks like a setting in the environment and is none."""
    from .settings import Settings

    known = {f"LINEFIX_{name.upper()}" for name in Settings.model_fields} | {*NO_SETTINGS}
    return sorted(name for name in os.environ if name.upper().startswith("LINEFIX_") and name.upper() not in known)


def run(settings: Settings) -> int:
    """Run until a signal comes; return the status to exit with."""
    import uvicorn

    from .telemetry.logs import log_config

    wrong = cannot_keep_maps(settings) or cannot_listen(settings)
    if wrong is not None:
        print(f"linefix: {wrong}", file=sys.stderr)
        return 1
    # Before and after the server's own handlers, which it sets in `uvicorn.run` and then raises the signal again.
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(0))
    with ExitStack() as stack:
        if settings.workers > 1:
            os.environ[COUNTS] = stack.enter_context(tempfile.TemporaryDirectory(prefix="linefix-workers-"))
        try:
            uvicorn.run(
                f"{__name__}:application",
                factory=True,
                host=settings.host,
                port=settings.port,
                workers=settings.workers,
                loop="uvloop",
                http="h11",
                h11_max_incomplete_event_size=MAX_HEAD,
                ws="none",
                lifespan="on",
                limit_concurrency=settings.share(settings.max_connections),
                timeout_keep_alive=math.ceil(settings.request_timeout_s),
                timeout_graceful_shutdown=GRACE,
                timeout_worker_healthcheck=HANG,
                ssl_certfile=settings.tls_cert,
                ssl_keyfile=settings.tls_key,
                log_config=log_config(settings.log_level),
                access_log=False,
                proxy_headers=False,
                server_header=False,
            )
        except SystemExit as ended:
            return 1 if ended.code else 0
    return 0


def application() -> FastAPI:
    """Return the application of this process, by the arguments that `serve` has put into the environment."""
    gc.disable()  # until the service is ready
    from .app import create_app
    from .memory import return_large_blocks
    from .settings import read_settings
    from .telemetry.metrics import forget_ended_workers

    return_large_blocks()
    sys.setswitchinterval(SWITCH_SECONDS)
    gc.set_threshold(*GARBAGE)
    if COUNTS in os.environ:
        forget_ended_workers(os.environ[COUNTS])
    return create_app(read_settings(json.loads(os.environ[ARGUMENTS])), started=drain_on_signals)


def drain_on_signals(services: Services) -> None:
    """Report 503 on `/readyz` for `drain_s` before the server closes: a balancer sends nothing to a closed port.

    Called in the event loop after the server has set its handlers. A second SIGINT closes the server at once.
    """
    loop, close = asyncio.get_running_loop(), signal.getsignal(signal.SIGTERM)
    assert callable(close)

    def drain(number: int) -> None:
        if services.readiness.draining:
            if number == signal.SIGINT:
                close(signal.SIGTERM, None)
            return
        services.readiness.draining = True
        loop.call_later(services.settings.drain_s, close, signal.SIGTERM, None)
        loop.call_later(services.settings.drain_s + GRACE - 1, services.give_up)

    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
        if signal.getsignal(number) is not signal.SIG_IGN:  # nohup has SIGHUP ignored
            loop.add_signal_handler(number, drain, number)


def cannot_keep_maps(settings: Settings) -> str | None:
    """Make the file of the maps where there is none; return why that will never do, None where it does or may yet.

    If it ran all the same, the service would never be ready, and only its log would show the reason.
    """
    from .database_location import file_of, make_file

    kept = file_of(settings.url)
    if kept is None or kept.exists():
        return None
    try:
        make_file(kept)
    except OSError as error:
        if error.errno not in AILING_DISK:
            return (
                f"maps cannot be stored in {kept.parent}: {error.strerror}; name another directory with --data-dir, or "
                "LINEFIX_DATA_DIR"
            )
    return None


def cannot_listen(settings: Settings) -> str | None:
    """Return why the service cannot listen at its address; None where it can. The server logs it as a defect."""
    try:
        family, kind, _, _, address = socket.getaddrinfo(settings.host, settings.port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind) as tried:
            tried.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            tried.bind(address)
    except OSError as error:
        where = f"{settings.host}, port {settings.port}"
        return f"cannot listen on {where}: {error.strerror}; name others with --host and --port"
    return None
