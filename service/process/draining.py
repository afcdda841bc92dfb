"""End the service: no longer ready, then closed, then ended within ten seconds.

The supervisor handles the signal. It notifies the workers, which report on `/readyz` that they take no more requests,
so that a balancer sends none. `drain_s` later it closes them.
"""

from __future__ import annotations

import asyncio
import multiprocessing
import os
import signal
import threading
from contextlib import suppress
from types import FrameType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..http.services import Services

GRACE = 5.5  # s for requests that run when the doors close
LAST_CALL = 9.5  # s after the signal a worker ends whatever still runs
NOTICE = signal.SIGUSR1  # from the supervisor to its workers: the service is about to end


def drain_on_signals(seconds: float) -> None:
    """Drain the workers before the server's own handling of SIGTERM and SIGINT; its handlers have to be there.

    SIGHUP ends the service as SIGTERM does, unless it was started so as to outlive its terminal. A second SIGINT closes
    the workers at once.

    Parameters
    ----------
    seconds : float
        For which requests are still answered while `/readyz` reports 503.
    """
    end = signal.getsignal(signal.SIGTERM)
    assert callable(end)
    draining = False

    def close() -> None:
        end(signal.SIGTERM, None)

    def drain(number: int, frame: FrameType | None) -> None:
        nonlocal draining
        if draining:
            if number == signal.SIGINT:
                close()
            return
        draining = True
        for worker in multiprocessing.active_children():
            if worker.pid is not None:
                with suppress(ProcessLookupError):
                    os.kill(worker.pid, NOTICE)
        closing = threading.Timer(seconds, close)
        closing.daemon = True
        closing.start()

    signal.signal(NOTICE, signal.SIG_IGN)  # workers inherit it: one that still starts is not killed by the notice
    for ends in (signal.SIGTERM, signal.SIGINT):
        signal.signal(ends, drain)
    hang_up = signal.getsignal(signal.SIGHUP)
    if _ignored_at_start:
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
    elif hang_up is not signal.SIG_IGN:
        signal.signal(signal.SIGHUP, drain)


_ignored_at_start = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN  # as nohup does; the server sets its own handler


def drain_on_notice(services: Services, loop: asyncio.AbstractEventLoop) -> None:
    """Have a worker stop being ready at the supervisor's notice, and end in time.

    SIGINT and SIGHUP reach all processes of a terminal. A worker leaves them to the supervisor.
    """

    def drain() -> None:
        services.readiness.draining = True
        loop.call_later(services.settings.drain_s + GRACE, services.give_up)
        # In a thread of its own: it comes even when the loop hangs.
        last = threading.Timer(LAST_CALL, os._exit, (1,))
        last.daemon = True
        last.start()

    loop.add_signal_handler(NOTICE, drain)
    for number in (signal.SIGINT, signal.SIGHUP):
        loop.add_signal_handler(number, lambda: None)
