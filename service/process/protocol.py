"""Admission at the socket: a request is decided upon when its turn on its connection begins.

What is refused there never reaches the application: under a flood, refusals are most of the work.
"""

from __future__ import annotations

import asyncio
from functools import partial
from typing import cast

from starlette.types import Scope
from uvicorn._types import ASGI3Application
from uvicorn.protocols.http.httptools_impl import RequestResponseCycle

from ..admission.entrance import search_of
from ..admission.errors import AdmissionError, MissingKeyError, ShareUsedError, UnknownKeyError
from ..http.problems import RAISED
from ..http.reception import taken_or_made
from ..http.state import state_of
from ..schemas.errors import RequestError
from .receipt import Exit, ReceiptProtocol

UNREAD = 65_536  # bytes; what is left of a refused body up to here is read and dropped, beyond it the connection ends
LATER = 0.05  # s after which who keeps others waiting is told to wait: told at once it would ask again at once
OTHER = "unmatched"
STRANGERS = (MissingKeyError, UnknownKeyError)
"""What ends the connection: nobody is served on it who has shown no key."""


class AdmittingProtocol(ReceiptProtocol):
    """Gives each request its ticket, or sends it away."""

    def _start_asgi_task(self, cycle: RequestResponseCycle, app: ASGI3Application) -> None:
        self._running = cycle
        self._services.connections.used(self)
        scope = cast("Scope", cycle.scope)
        state = state_of(scope)
        assert state is not None
        try:
            state.ticket = self._services.entrance.admit(scope)
        except ShareUsedError as error:
            self.loop.call_later(LATER, self._refuse, cycle, error)
            return
        except (AdmissionError, RequestError) as error:
            self._refuse(cycle, error)
            return
        if not cycle.more_body:
            state.ticket.announce()
        state.is_unread = partial(_is_unread, cycle, scope)
        cycle.transport = cast("asyncio.Transport", Exit(self, has_body=scope["method"] != "HEAD"))
        super()._start_asgi_task(cycle, app)

    def on_message_complete(self) -> None:
        """Count a request whose body is there as one that is on its way to the gate."""
        state = state_of(cast("Scope", self.scope))
        if state is not None and state.ticket is not None and not self.cycle.response_complete:
            state.ticket.announce()
        super().on_message_complete()

    def _refuse(self, cycle: RequestResponseCycle, error: AdmissionError | RequestError) -> None:
        """Answer in place of the application, unless there is nobody, or nothing, left to answer."""
        if self._lost or cycle.response_complete:
            return
        scope = cast("Scope", cycle.scope)
        close = isinstance(error, STRANGERS) or _is_unread(cycle, scope) or not cycle.keep_alive
        cycle.response_started = cycle.response_complete = True
        self.write_refusal(error, taken_or_made(scope["headers"]), close=close)
        kind, method, path = RAISED[type(error)], scope["method"], scope["path"]
        self._services.refusals.count(search_of(method, path) or OTHER, method, kind.code, kind.status)
        if close:
            return
        if self.pipeline:
            # Called later, not from here: thousands of pipelined requests would nest too deeply.
            self.loop.call_soon(self.on_response_complete)
        else:
            self.on_response_complete()


def _is_unread(cycle: RequestResponseCycle, scope: Scope) -> bool:
    """Tell whether more of a body is left than can be read and dropped."""
    if not cycle.more_body:
        return False
    sizes = [value for name, value in scope["headers"] if name == b"content-length"]
    return len(sizes) != 1 or int(sizes[0]) > UNREAD or cycle.waiting_for_100_continue
