"""/v1/analyze and /v1/maps/{map_id}:analyze: where a robot would not know where it is."""

from __future__ import annotations

from functools import partial

from fastapi import APIRouter, Response

from linefix.documents import examples
from linefix.documents.analysis import AnalyzeAnswer, AnalyzeRequest, MapAnalyzeRequest
from linefix.documents.parts import InlineMap, StoredMap
from linefix.documents.reading import read_model

from ...work.analyzing import analysis_done, begin_analysis, take_looks
from ...work.job import Done, Job
from ..body_stage import read
from ..exchange import Exchange, Searching
from ..map_stage import index_map, looking_up_map
from ..search_stage import in_search_slot, in_short_slots
from ..sending import answer
from .declaring import EVERYWHERE, READS_BODY, SEARCHES, problems, takes
from .maps import MapIdPath

router = APIRouter()
_FAILS = (*EVERYWHERE, *SEARCHES, "unknown_map", "map_corrupt", "read_only")


@router.post(
    "/v1/maps/{map_id}:analyze",
    operation_id="analyze_map",
    tags=["maps"],
    response_model=AnalyzeAnswer,
    responses=problems(*_FAILS, *READS_BODY),
    openapi_extra=takes(AnalyzeRequest, {"a robot": examples.ANALYZE}),
    summary="Analyze a stored map",
)
async def post_analyze(exchange: Searching, map_id: MapIdPath) -> Response:
    """Simulate scans on a grid of poses and report where localization succeeds."""
    asked = await read(exchange, partial(read_model, AnalyzeRequest))
    return await _answer(exchange, StoredMap(map_id=map_id), asked)


@router.post(
    "/v1/analyze",
    operation_id="analyze",
    response_model=AnalyzeAnswer,
    responses=problems(*_FAILS, *READS_BODY),
    openapi_extra=takes(MapAnalyzeRequest, {"a room": examples.ANALYZE_ROOM}),
    summary="Analyze a map that comes with the request",
)
async def post_analyze_inline(exchange: Searching) -> Response:
    """Simulate scans on a grid of poses of a map in the request."""
    asked = await read(exchange, partial(read_model, MapAnalyzeRequest))
    return await _answer(exchange, asked.map, asked)


async def _answer(exchange: Exchange, source: InlineMap | StoredMap, asked: AnalyzeRequest) -> Response:
    job = exchange.job(asked.deadline_ms)
    return await answer(exchange, _work(exchange, source, asked, job), job.deadline)


async def _work(exchange: Exchange, named: InlineMap | StoredMap, asked: AnalyzeRequest, job: Job) -> Done:
    """Index the map in one slot at the gate, and try its places in as many short ones as it takes."""
    lookup = exchange.services.lookup
    async with looking_up_map(exchange, named, job.deadline, oriented=None) as source:
        await index_map(exchange, source, job.deadline, oriented=None)
        work = partial(begin_analysis, lookup, source, asked, job)
        tally = await in_search_slot(exchange, work, job.deadline, job.searching.is_set)
    if not tally.done:
        await in_short_slots(exchange, partial(take_looks, tally, job.deadline), job.deadline)
    return await exchange.services.parse_threads.run(partial(analysis_done, tally, asked, job))
