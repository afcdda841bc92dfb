"""The exchange of one request: its ticket, state and clock, from its body to its answer.

The stages are functions of `receiving`, `map_stage` and `turns`, each of which takes an exchange.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from starlette.requests import Request
from starlette.responses import Response

from ..admission.ticket import Ticket
from ..work.job import Done, Job, Stopwatch
from .sending import json_response
from .services import Services, services_of
from .state import RequestState, state_of


@dataclass(slots=True)
class Exchange:
    """One request, and what it is answered with.

    Attributes
    ----------
    request : Request
    services : Services
        Of the application that it came to.
    state : RequestState
    ticket : Ticket
    watch : Stopwatch
        Since the body had arrived.
    """

    request: Request
    services: Services
    state: RequestState
    ticket: Ticket
    watch: Stopwatch = field(default_factory=Stopwatch)

    def note(self, **fields: object) -> None:
        """Add fields to the log's line of this request."""
        self.state.noted.update(fields)

    def job(self, deadline_ms: float | None = None) -> Job:
        """Return the job of this request; without a deadline of its own it has the service's."""
        deadline = self.watch.deadline(deadline_ms, self.services.settings.max_deadline_ms)
        return Job(self.state.request_id, self.watch, deadline)

    def answer(self, done: Done) -> Response:
        """Return the result of the work as a response."""
        self.note(**done.noted)
        return json_response(done.body)


def begin(request: Request) -> Exchange:
    """Return the exchange of a request that was admitted."""
    state = state_of(request.scope)
    assert state is not None
    assert state.ticket is not None
    return Exchange(request, services_of(request.scope), state, state.ticket)


def begin_search(request: Request) -> Exchange:
    """Return the exchange of a request that needs the kernels.

    Raises
    ------
    NotReadyError
        When they are not there yet; before the body is read.
    """
    exchange = begin(request)
    exchange.services.readiness.require_warm()
    return exchange
