"""The second stage of a request: its map is looked up in the store, and indexed where that takes long."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from functools import partial
from typing import TypeVar

from association import Deadline
from linefix.documents.errors import DeadlinePassedError
from linefix.documents.parts import InlineMap, StoredMap
from linefix.documents.requests import AssociateRequest, BatchRequest

from ..errors import StoreAwayError, UnknownMapError
from ..maps import CachedMap
from ..maps.lookup import FoundMaps
from .exchange import Exchange
from .services import Services

T = TypeVar("T")
NO_DEADLINE = Deadline()
STORE_SECONDS = 8.0  # for an answer of the store; a write may wait for others for some seconds


@asynccontextmanager
async def looking_up_map(
    exchange: Exchange, asked: InlineMap | StoredMap, deadline: Deadline, *, oriented: bool | None
) -> AsyncIterator[FoundMaps]:
    """Look a stored map up before its slot at the gate: a database server that hangs delays no other request.

    Its document counts as held until the block ends. `oriented` None: as the map states.

    Raises
    ------
    UnknownMapError
        When there is no such map for this caller.
    StoreError
        When it cannot be had.
    TooMuchHeldError, ShareHeldError
        When too much is held already.
    DeadlinePassedError
        When the deadline passes first.
    """
    if isinstance(asked, InlineMap):
        yield FoundMaps({None: asked})
        return
    if not asked.map_id.startswith(exchange.ticket.maps):
        raise UnknownMapError
    services = exchange.services
    store = services.store
    record = store.record_at_once(asked.map_id)
    if record is None:
        record = await ask_store(services, partial(store.record, asked.map_id), deadline)
    found = FoundMaps({None: record})
    if services.lookup.is_cached(found, oriented=oriented):
        yield found
        return
    with services.documents.account(exchange.ticket.holder) as account:
        account.take(record.size)
        stored = await ask_store(services, partial(store.load, asked.map_id), deadline)
        account.take(stored.record.size - record.size)  # another revision may have come
        yield FoundMaps({None: stored.record}, stored.document)


@asynccontextmanager
async def looking_up_maps(
    exchange: Exchange, asked: AssociateRequest | BatchRequest, deadline: Deadline
) -> AsyncIterator[FoundMaps]:
    """Look up the map of a request, or its maps; raises as `looking_up_map`, and `InvalidRequestError` for a prefix."""
    if asked.map is not None:
        async with looking_up_map(exchange, asked.map, deadline, oriented=asked.options.oriented) as source:
            yield source
        return
    assert asked.maps is not None
    services, prefix = exchange.services, exchange.ticket.maps
    if isinstance(asked.maps, list) and any(
        isinstance(one, StoredMap) and not one.map_id.startswith(prefix) for one in asked.maps
    ):
        raise UnknownMapError
    yield await ask_store(services, partial(services.lookup.find_together, asked.maps, prefix), deadline)


async def index_map(
    exchange: Exchange, source: FoundMaps, deadline: Deadline, *, oriented: bool | None
) -> CachedMap | None:
    """Index a map for which that takes long, or several, in a slot of another gate: its threads go behind all searches.

    None where it is left to the search's own slot.
    """
    services = exchange.services
    if not services.lookup.takes_long(source, oriented=oriented):
        return None
    index = partial(services.lookup.indexed, source, oriented=oriented, deadline=deadline)
    with services.documents.account(exchange.ticket.holder) as account:
        account.take(source.unread_bytes)
        return await services.indexing.run(index, deadline, exchange.ticket)


async def ask_store(services: Services, call: Callable[[], T], deadline: Deadline = NO_DEADLINE) -> T:
    """Return what the store returns, in one of its threads.

    Raises
    ------
    StoreError
        When it cannot complete the call, or does not answer in `STORE_SECONDS`. The data may have been written all
        the same.
    DeadlinePassedError
        When the deadline passes first.
    """
    left = math.inf if deadline.at is None else max(0.0, deadline.at - time.monotonic())
    try:
        async with asyncio.timeout(min(left, STORE_SECONDS)):
            return await services.store_threads.run(call)
    except TimeoutError:
        raise (DeadlinePassedError if left < STORE_SECONDS else StoreAwayError) from None
