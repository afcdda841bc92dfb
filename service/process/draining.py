"""How the process ends: no longer ready, doors closed, what runs finished, and out in ten seconds whatever happens."""

from __future__ import annotations

import asyncio
import os
import signal
import threading
from collections.abc import Callable
from types import FrameType
from typing import TYPE_CHECKING

from uvicorn.server import HANDLED_SIGNALS

if TYPE_CHECKING:
    from ..http.services import Services

GRACE = 6  # s for requests that run when the doors close
LAST_CALL = 9.5  # s after the signal the process ends whatever still runs


def drain_on_signals(services: Services, loop: asyncio.AbstractEventLoop) -> None:
    """Put a time of draining before what uvicorn does at a signal; its handlers have to be there already.

    `/readyz` says no for `drain_seconds`, so that a balancer sends nothing more; then uvicorn closes its doors and
    waits for what runs, `GRACE` seconds at most. A further Ctrl-C goes to uvicorn at once.
    """
    theirs = {number: signal.getsignal(number) for number in HANDLED_SIGNALS}

    def close(number: int) -> None:
        handler = theirs[signal.Signals(number)]
        assert callable(handler)
        handler(number, None)

    def handle(number: int, frame: FrameType | None) -> None:
        if services.readiness.draining:
            if number == signal.SIGINT:
                close(number)
            return
        services.readiness.draining = True
        loop.call_soon_threadsafe(drain, number)
        # In a thread of its own: it comes even when the loop hangs.
        last = threading.Timer(LAST_CALL, os._exit, (1,))
        last.daemon = True
        last.start()

    def drain(number: int) -> None:
        seconds = services.settings.drain_seconds
        loop.call_later(seconds, close, number)
        loop.call_later(seconds + GRACE, services.give_up)

    for number in HANDLED_SIGNALS:
        signal.signal(number, handle)
    drain_on_hang_up(lambda: handle(signal.SIGTERM, None))


def drain_on_hang_up(drain: Callable[[], None]) -> None:
    """Have SIGHUP end the process as SIGTERM does, unless it was started so as to outlive its terminal."""
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:
        signal.signal(signal.SIGHUP, lambda *_: drain())
