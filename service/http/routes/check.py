"""/v1/maps/{map_id}:check: what is doubtful in a stored map."""

from __future__ import annotations

from functools import partial
from typing import Annotated

from fastapi import APIRouter, Query, Response

from linefix.documents import examples
from linefix.documents.checks import CheckAnswer
from linefix.documents.parts import StoredMap
from linefix.documents.reading import read_model
from linefix.documents.requests import CheckRequest
from map_quality import Sample

from ...admission.errors import DeadlinePassedError
from ...maps.lookup import FoundMap
from ...work.checking import check, check_done, conclude, sample
from ...work.job import Done, Job
from ..body_stage import read
from ..exchange import Exchange, Searching
from ..map_stage import index_map, looking_up_map
from ..search_stage import in_search_slot, in_search_slots
from ..sending import answer
from .declaring import EVERYWHERE, READS_BODY, SEARCHES, problems, takes
from .maps import MapIdPath

router = APIRouter(tags=["maps"])
_FAILS = (*EVERYWHERE, *SEARCHES, "unknown_map", "map_corrupt", "invalid_request", "read_only")


@router.get(
    "/v1/maps/{map_id}:check",
    operation_id="check_map",
    response_model=CheckAnswer,
    responses=problems(*_FAILS),
    summary="Check a map",
)
async def get_check(
    exchange: Searching,
    map_id: MapIdPath,
    deadline_ms: Annotated[
        float | None,
        Query(ge=0.0, le=600_000.0, description="milliseconds; parts that it leaves no time for are omitted"),
    ] = None,
) -> Response:
    """Check a map: its directions, its drawing, its size, and its similar places."""
    exchange.services.gate.enter(exchange.ticket)
    job = exchange.job(deadline_ms)
    return await answer(exchange, _work(exchange, map_id, None, job), job.deadline)


@router.post(
    "/v1/maps/{map_id}:check",
    operation_id="check_map_with_scans",
    response_model=CheckAnswer,
    responses=problems(*dict.fromkeys((*_FAILS, *READS_BODY))),
    openapi_extra=takes(CheckRequest, {"two scans": examples.CHECK}),
    summary="Check a map with sample scans",
)
async def post_check(exchange: Searching, map_id: MapIdPath) -> Response:
    """Check a map, and whether sample scans fit better mirrored, undirected, scaled or moved."""
    asked = await read(exchange, partial(read_model, CheckRequest))
    job = exchange.job(asked.deadline_ms)
    return await answer(exchange, _work(exchange, map_id, asked, job), job.deadline)


async def _work(exchange: Exchange, map_id: str, asked: CheckRequest | None, job: Job) -> Done:
    """Check the map in one slot at the gate, and try each sample in another."""
    lookup = exchange.services.lookup
    async with looking_up_map(exchange, StoredMap(map_id=map_id), job.deadline, oriented=True) as source:
        assert isinstance(source, FoundMap)  # what is stored is found, or else an exception
        await index_map(exchange, source, job.deadline, oriented=True)
        work = partial(check, lookup, source, asked, job)
        begun = await in_search_slot(exchange, work, job.deadline, job.searching.is_set)
    calls = [] if asked is None else [partial(sample, begun, asked, number, job) for number in range(len(asked.scans))]
    concluding = partial(conclude, begun, await in_search_slots(exchange, calls, job.deadline, _too_late), job)
    try:
        checked = await in_search_slot(exchange, concluding, job.deadline) if calls else concluding()
    except DeadlinePassedError:  # no slot is left: it then concludes from what it has, and searches nothing
        checked = await exchange.services.parse_threads.run(concluding)
    return await exchange.services.parse_threads.run(partial(check_done, begun, checked, asked, job))


def _too_late(_: int, error: Exception) -> Sample | None:
    """Leave out a sample whose slot came too late."""
    if not isinstance(error, DeadlinePassedError):
        raise error
    return None
