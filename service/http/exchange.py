"""One request while it is served, from its head to its line in the log; routes get it by `Depends`.

Its stages are functions of `bodies`, `map_stage` and `search_stage`, each of which takes an exchange.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated

from fastapi import Depends
from starlette.requests import Request
from starlette.types import Scope

from linefix.operations import Stopwatch

from ..admission.gate import Ticket
from ..work.job import Job
from .services import Services

KEY = "exchange"
"""Key of the exchange in the state of a request's scope."""


@dataclass(slots=True)
class Exchange:
    """One request.

    Attributes
    ----------
    services : Services
        Of its application.
    request : Request
    arrived : float
        When its head arrived, by the event loop's clock, seconds.
    request_id : str
    ticket : Ticket
        Its admission.
    watch : Stopwatch
        Since the body had arrived.
    noted : dict
        Further fields of its line in the log.
    """

    services: Services
    request: Request
    arrived: float
    request_id: str
    ticket: Ticket = field(default_factory=Ticket)
    watch: Stopwatch = field(default_factory=Stopwatch)
    noted: dict[str, object] = field(default_factory=dict)

    def note(self, **fields: object) -> None:
        """Add fields to the log's line of this request."""
        self.noted.update(fields)

    def job(self, deadline_ms: float | None = None) -> Job:
        """Return the job of this request; without a deadline of its own it has the service's."""
        deadline = self.watch.deadline(deadline_ms, self.services.settings.max_deadline_ms)
        return Job(self.request_id, self.watch, deadline)


def exchange_of(scope: Scope) -> Exchange:
    """Return the exchange of a request, which the middleware has put into its scope."""
    found = scope["state"][KEY]
    assert isinstance(found, Exchange)
    return found


async def _any(request: Request) -> Exchange:
    return exchange_of(request.scope)


async def _searching(request: Request) -> Exchange:
    exchange = exchange_of(request.scope)
    exchange.services.readiness.require_warm()  # before the body is read
    return exchange


Admitted = Annotated[Exchange, Depends(_any)]
"""A request that was let in."""
Searching = Annotated[Exchange, Depends(_searching)]
"""One that needs the kernels; `NotReadyError` when they are not there yet."""
