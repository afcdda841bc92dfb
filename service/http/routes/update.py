"""/v1/maps/{map_id}:update and /v1/maps:apply: what has changed in a building, and a map with accepted changes."""

from __future__ import annotations

import asyncio
from functools import partial

from fastapi import APIRouter, Response

from linefix.documents import examples
from linefix.documents.parts import StoredMap
from linefix.documents.reading import read_model
from linefix.documents.updates import ApplyAnswer, ApplyRequest, UpdateAnswer, UpdateRequest

from ...maps.lookup import FoundMap
from ...work.job import Done, Job
from ...work.updating import answer_apply, begin_update, take_steps, update_done
from ..body_stage import read
from ..exchange import Exchange, Searching
from ..map_stage import index_map, looking_up_map
from ..search_stage import in_search_slot, in_short_slots
from ..sending import answer
from .declaring import EVERYWHERE, READS_BODY, SEARCHES, problems, takes
from .maps import MapIdPath

router = APIRouter(tags=["maps"])
_FAILS = (*EVERYWHERE, *SEARCHES, "unknown_map", "map_corrupt", "read_only")


@router.post(
    "/v1/maps/{map_id}:update",
    operation_id="update_map",
    response_model=UpdateAnswer,
    responses=problems(*_FAILS, *READS_BODY),
    openapi_extra=takes(UpdateRequest, {"two visits": examples.UPDATE}),
    summary="Propose changes of a stored map",
)
async def post_update(exchange: Searching, map_id: MapIdPath) -> Response:
    """Propose changes of a map that scans of several visits show; nothing is stored."""
    asked = await read(exchange, partial(read_model, UpdateRequest))
    job = exchange.job(asked.deadline_ms)
    return await answer(exchange, _work(exchange, map_id, asked, job), job.deadline)


@router.post(
    "/v1/maps:apply",
    operation_id="apply_changes",
    response_model=ApplyAnswer,
    responses=problems(*EVERYWHERE, *READS_BODY, *SEARCHES),
    openapi_extra=takes(ApplyRequest, {"a rack is gone": examples.APPLY}),
    summary="Apply the accepted changes of an update",
)
async def post_apply(exchange: Searching) -> Response:
    """Return a map with those changes of an update that are accepted; nothing is searched or stored."""
    asked = await read(exchange, partial(read_model, ApplyRequest))
    job = exchange.job()
    return await answer(
        exchange, in_search_slot(exchange, partial(answer_apply, asked, job), job.deadline), job.deadline
    )


async def _work(exchange: Exchange, map_id: str, asked: UpdateRequest, job: Job) -> Done:
    """Index the map in one slot at the gate, and go through the scans in as many short ones as it takes."""
    lookup = exchange.services.lookup
    async with looking_up_map(exchange, StoredMap(map_id=map_id), job.deadline, oriented=None) as source:
        assert isinstance(source, FoundMap)  # what is stored is found, or else an exception
        await index_map(exchange, source, job.deadline, oriented=None)
        begin = partial(begin_update, lookup, source, asked, job)
        progress = await in_search_slot(exchange, begin, job.deadline, job.searching.is_set)
    work = partial(take_steps, progress, job.deadline)
    if not await in_short_slots(exchange, work, job.deadline):  # it then ends without a proposal, and searches nothing
        while await exchange.services.parse_threads.run(work):
            await asyncio.sleep(0)
    return await exchange.services.parse_threads.run(partial(update_done, progress, asked, job))
