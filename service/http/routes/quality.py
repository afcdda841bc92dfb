"""The quality of a map: /v1/maps/{map_id}:check, :analyze and :update, /v1/analyze, /v1/maps:apply."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response

from association import MapIndex
from linefix.documents import examples
from linefix.documents.analysis import AnalyzeAnswer, AnalyzeRequest, MapAnalyzeRequest
from linefix.documents.applying import ApplyAnswer, ApplyRequest
from linefix.documents.checks import CheckAnswer
from linefix.documents.parts import InlineMap, StoredMap
from linefix.documents.requests import NO_SAMPLES, CheckRequest
from linefix.documents.updates import UpdateAnswer, UpdateRequest
from linefix.operations import Json, Steps, analysis_steps, applied, check_steps, update_steps

from ...maps.lookup import FoundMaps
from ...telemetry.traces import queued
from ...work.job import Done, Job, Operation, begin
from ..bodies import read_request
from ..exchange import Exchange, Searching
from ..map_stage import looking_up_map
from ..openapi import EVERYWHERE, SEARCHES, problems, searches
from ..search_stage import in_short_slots
from ..sending import answer, answer_in_slot
from .maps import MapIdPath

router = APIRouter()
_STORED = ("unknown_map", "map_corrupt", "read_only")


@router.post(
    "/v1/maps/{map_id}:analyze",
    tags=["maps"],
    response_model=AnalyzeAnswer,
    summary="Analyze a stored map",
    **searches(AnalyzeRequest, {"a robot": examples.ANALYZE}, *_STORED),
)
async def analyze_map(exchange: Searching, map_id: MapIdPath) -> Response:
    """Simulate scans on a grid of poses and report where localization succeeds."""
    asked = await read_request(exchange, AnalyzeRequest)
    return await _analyze(exchange, StoredMap(map_id=map_id), asked)


@router.post(
    "/v1/analyze",
    response_model=AnalyzeAnswer,
    summary="Analyze a map that comes with the request",
    **searches(MapAnalyzeRequest, {"a room": examples.ANALYZE_ROOM}, *_STORED),
)
async def analyze(exchange: Searching) -> Response:
    """Simulate scans on a grid of poses of a map in the request."""
    asked = await read_request(exchange, MapAnalyzeRequest)
    return await _analyze(exchange, asked.map, asked)


async def _analyze(exchange: Exchange, on: InlineMap | StoredMap, asked: AnalyzeRequest) -> Response:
    job, noted = exchange.job(asked.deadline_ms), {"places": lambda found: found["summary"]["places"]}

    def steps(index: MapIndex, _: FoundMaps) -> Steps:
        return analysis_steps(index, asked, job.deadline)

    return await _in_turns(exchange, on, steps, job, noted, client_ref=asked.client_ref)


@router.get(
    "/v1/maps/{map_id}:check",
    tags=["maps"],
    response_model=CheckAnswer,
    responses=problems(*EVERYWHERE, *SEARCHES, *_STORED, "invalid_request"),
    summary="Check a map",
)
async def check_map(
    exchange: Searching,
    map_id: MapIdPath,
    deadline_ms: Annotated[
        float | None,
        Query(ge=0.0, le=600_000.0, description="milliseconds; parts that it leaves no time for are omitted"),
    ] = None,
) -> Response:
    """Check a map: its directions, its drawing, its size, and its similar places."""
    exchange.services.gate.enter(exchange.ticket)
    return await _check(exchange, map_id, NO_SAMPLES, exchange.job(deadline_ms))


@router.post(
    "/v1/maps/{map_id}:check",
    tags=["maps"],
    response_model=CheckAnswer,
    summary="Check a map with sample scans",
    **searches(CheckRequest, {"two scans": examples.CHECK}, *_STORED),
)
async def check_map_with_scans(exchange: Searching, map_id: MapIdPath) -> Response:
    """Check a map, and whether sample scans fit better mirrored, undirected, scaled or moved."""
    asked = await read_request(exchange, CheckRequest)
    return await _check(exchange, map_id, asked, exchange.job(asked.deadline_ms))


async def _check(exchange: Exchange, map_id: str, asked: CheckRequest, job: Job) -> Response:
    noted = {"findings": lambda found: [one["code"] for one in found["findings"]]}
    on = StoredMap(map_id=map_id)

    def steps(index: MapIndex, source: FoundMaps) -> Steps:
        # An index of its own: one without directions, which a check may add to it, goes with the check, for the cache
        # does not count it.
        return check_steps(replace(index), source.maps[None].oriented, asked, job.deadline)

    return await _in_turns(exchange, on, steps, job, noted, oriented=True, client_ref=asked.client_ref)


@router.post(
    "/v1/maps/{map_id}:update",
    tags=["maps"],
    response_model=UpdateAnswer,
    summary="Propose changes of a stored map",
    **searches(UpdateRequest, {"two visits": examples.UPDATE}, *_STORED),
)
async def update_map(exchange: Searching, map_id: MapIdPath) -> Response:
    """Propose changes of a map that scans of several visits show; nothing is stored."""
    asked = await read_request(exchange, UpdateRequest)
    on, job = StoredMap(map_id=map_id), exchange.job(asked.deadline_ms)
    noted = {"changes": lambda found: len(found["changes"])}

    def steps(index: MapIndex, source: FoundMaps) -> Steps:
        old = exchange.services.lookup.document(source.maps[None], source.document)
        return update_steps(index, old, asked, job.deadline)

    return await _in_turns(exchange, on, steps, job, noted, name="based_on", client_ref=asked.client_ref)


@router.post(
    "/v1/maps:apply",
    tags=["maps"],
    response_model=ApplyAnswer,
    summary="Apply the accepted changes of an update",
    **searches(ApplyRequest, {"a rack is gone": examples.APPLY}),
)
async def apply_changes(exchange: Searching) -> Response:
    """Return a map with those changes of an update that are accepted; nothing is searched or stored."""
    asked = await read_request(exchange, ApplyRequest)
    accepted = sum(one.accepted for one in asked.changes)

    def work(job: Job) -> Done:
        return job.done({**applied(asked, job.watch), "client_ref": asked.client_ref}, changes=accepted)

    return await answer_in_slot(exchange, work)


async def _in_turns(
    exchange: Exchange,
    on: InlineMap | StoredMap,
    operation: Operation,
    job: Job,
    noted: Mapping[str, Callable[[Json], Any]],
    *,
    oriented: bool | None = None,
    name: str = "map",
    client_ref: Any,
) -> Response:
    """Answer with an operation on a map; `noted` are fields of the log, `name` is that of the map's reference."""

    async def work() -> Done:
        services, run = exchange.services, exchange.services.parse_threads.run
        async with looking_up_map(exchange, on, job.deadline, oriented=oriented) as source:
            reference = source.references[None]
            beginning = partial(begin, operation, services.lookup, source, job, oriented=oriented)
            # Reading and indexing do not look at the deadline, so they take no slot of a search.
            begun = await services.indexing.run(queued(beginning), job.deadline, exchange.ticket)
        if not await in_short_slots(exchange, begun.take_turn, job.deadline):  # the rest then searches nothing
            while await run(begun.take_turn):
                await asyncio.sleep(0)
        found = begun.answer
        assert found is not None  # every step is taken
        job.watch.lap("search")
        sealed = {**found, name: reference, "client_ref": client_ref}
        told = {field: read(found) for field, read in noted.items()}
        return await run(lambda: job.done(sealed, map=reference, **told))

    return await answer(exchange, work(), job.deadline)
