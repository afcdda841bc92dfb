"""What belongs to one request from its first byte to the line in the log, and where it is kept."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, cast

from starlette.types import Scope

from ..admission.ticket import Ticket
from ..telemetry.traces import Trail

_KEY = "request"  # in `scope["state"]`, beside the application's own


@dataclass(slots=True)
class RequestState:
    """One request's own state.

    Attributes
    ----------
    arrived : float
        When its head was there, by the event loop's clock, seconds.
    ticket : Ticket, or None
        What was decided about it; None as long as nothing is.
    request_id : str
        Empty as long as it has none.
    noted : dict
        What the log is to say of it beside the usual.
    trail : Trail, or None
        What it did, where it is traced.
    """

    arrived: float
    ticket: Ticket | None = None
    request_id: str = ""
    noted: dict[str, object] = field(default_factory=dict)
    trail: Trail | None = None


def attach(scope: Scope, state: RequestState) -> None:
    """Keep a request's state with the request."""
    cast("dict[str, Any]", scope.setdefault("state", {}))[_KEY] = state


def state_of(scope: Scope) -> RequestState | None:
    """Return a request's state, None where it has none yet."""
    found = scope.get("state", {}).get(_KEY)
    return found if isinstance(found, RequestState) else None
