"""The stage of a request that searches: its turns at the gate, given up when the client is gone."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any, TypeVar

from association import Deadline

from ..admission.gate import Gate
from ..admission.ticket import Ticket
from ..telemetry.traces import queued
from .exchange import Exchange
from .hanging_up import hang_up, unless

T = TypeVar("T")


async def search(
    exchange: Exchange, call: Callable[[], T], deadline: Deadline, heeds: Callable[[], bool] = lambda: True
) -> T:
    """Run a search when its turn comes; give up when the client does."""
    return await unless_hung_up(exchange, take_turn(exchange, call, deadline, heeds), deadline)


async def take_turn(
    exchange: Exchange, call: Callable[[], T], deadline: Deadline, heeds: Callable[[], bool] = lambda: True
) -> T:
    """Run a part of this request when its turn comes; what was let in once is not sent away later.

    A call that does not heed the deadline is waited for until then and no longer: see `Gate.run`.
    """
    return await exchange.services.gate.run(queued(call), deadline, exchange.ticket, heeds)


async def take_other_turn(exchange: Exchange, gate: Gate, call: Callable[[], T], deadline: Deadline) -> T:
    """Run a part of this request, which is short or heeds the deadline, in a turn of another kind."""
    # By a ticket of its own: the request is still on its way to its search.
    return await gate.run(call, deadline, Ticket(exchange.ticket.holder), lambda: True)


async def unless_hung_up(exchange: Exchange, work: Coroutine[Any, Any, T], deadline: Deadline) -> T:
    """Wait for work, or cancel it when the client is gone first.

    Raises
    ------
    HangUpError
        When the client is gone.
    """
    return await unless(partial(hang_up, exchange.request), work, deadline)
