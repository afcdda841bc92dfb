"""The stages of a request after its body: its maps are looked up and indexed, and searched in slots of a gate."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Callable
from functools import partial
from typing import TypeVar

from linefix.documents.errors import DeadlinePassedError
from linefix.documents.parts import InlineMap, StoredMap
from linefix.documents.requests import AssociateRequest, BatchRequest
from linefix.operations import Target, require_time

from ..errors import StoreAwayError, UnknownMapError
from ..maps import CachedMap
from ..maps.lookup import FoundMaps
from .exchange import Exchange

T = TypeVar("T")
STORE_SECONDS = 8.0  # for an answer of the store; a write may wait for others for some seconds


async def look_up_map(exchange: Exchange, asked: InlineMap | StoredMap, *, oriented: bool | None) -> FoundMaps:
    """Look a stored map up before its slot at the gate: a database server that hangs delays no other request.

    Its document counts as held until the exchange ends. `oriented` None: as the map states.

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
        return FoundMaps({None: asked})
    if not asked.map_id.startswith(exchange.ticket.maps):
        raise UnknownMapError
    services = exchange.services
    record = services.store.record_at_once(asked.map_id)
    if record is None:
        record = await ask_store(exchange, partial(services.store.record, asked.map_id))
    found = FoundMaps({None: record})
    if services.lookup.is_cached(found, oriented=oriented):
        return found
    take = exchange.held.enter_context(services.documents.account(exchange.ticket.holder))
    take(record.size)
    stored = await ask_store(exchange, partial(services.store.load, asked.map_id))
    take(stored.record.size - record.size)  # another revision may have come
    return FoundMaps({None: stored.record}, stored.document)


async def look_up_maps(exchange: Exchange, asked: AssociateRequest | BatchRequest) -> Target:
    """Look up the map of a request, or its maps, and index them; raises as `look_up_map` and `index`."""
    oriented = asked.options.oriented
    if asked.map is not None:
        found = await look_up_map(exchange, asked.map, oriented=oriented)
    else:
        assert asked.maps is not None
        find = partial(exchange.services.lookup.find_together, asked.maps, exchange.ticket.maps)
        found = await ask_store(exchange, find)
    ready = await index(exchange, found, oriented=oriented)
    return Target(ready.maps, found.references, asked.map_weights)


async def index(exchange: Exchange, found: FoundMaps, *, oriented: bool | None) -> CachedMap:
    """Index a map in a slot of a search, and one for which that takes long in one of another gate: searches go first.

    Indexing does not look at the deadline: in one gate, a small map would wait for a large one. Raises as
    `MapLookup.indexed`, and `DeadlinePassedError`.
    """
    services = exchange.services
    require_time(exchange.deadline)
    ready = services.lookup.cached(found, oriented=oriented)
    if ready is not None:
        return ready
    build = partial(services.lookup.indexed, found, oriented=oriented, deadline=exchange.deadline)
    with services.documents.account(exchange.ticket.holder) as take:
        take(found.unread_bytes)
        gate = services.indexing if services.lookup.takes_long(found) else services.gate
        return await exchange.run(build, gate)


async def ask_store(exchange: Exchange, call: Callable[[], T]) -> T:
    """Return what the store returns, in one of its threads.

    Raises
    ------
    StoreError
        When it cannot complete the call, or does not answer in `STORE_SECONDS`. The data may have been written all
        the same.
    DeadlinePassedError
        When the deadline passes first.
    """
    deadline = exchange.deadline
    left = math.inf if deadline.at is None else max(0.0, deadline.at - time.monotonic())
    try:
        async with asyncio.timeout(min(left, STORE_SECONDS)):
            return await exchange.services.store_threads.run(call)
    except TimeoutError:
        raise (DeadlinePassedError if left < STORE_SECONDS else StoreAwayError) from None
