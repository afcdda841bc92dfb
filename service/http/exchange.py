"""One request while it is served: its state from the first byte to the line in the log, and the exchange of its stages.

The stages are functions of `body_stage`, `map_stage` and `search_stage`, each of which takes an exchange.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, cast

from starlette.requests import Request
from starlette.types import Scope

from linefix.answering import Stopwatch

from ..admission.gate import Ticket
from ..work.job import Job
from .services import Services, services_of

_KEY = "request"  # in `scope["state"]`, next to the application's own


@dataclass(slots=True)
class RequestState:
    """State of one request.

    Attributes
    ----------
    arrived : float
        When its head arrived, by the event loop's clock, seconds.
    request_id : str
    ticket : Ticket, or None
        Its admission; None until it is admitted.
    noted : dict
        Further fields of its line in the log.
    """

    arrived: float
    request_id: str
    ticket: Ticket | None = None
    noted: dict[str, object] = field(default_factory=dict)


def attach(scope: Scope, state: RequestState) -> None:
    """Store the state of a request in its scope."""
    cast("dict[str, Any]", scope.setdefault("state", {}))[_KEY] = state


def state_of(scope: Scope) -> RequestState | None:
    """Return the state of a request, None where it has none yet."""
    found = scope.get("state", {}).get(_KEY)
    return found if isinstance(found, RequestState) else None


@dataclass(slots=True)
class Exchange:
    """One admitted request.

    Attributes
    ----------
    request : Request
    services : Services
        Of its application.
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
