"""The quality of a map: /v1/maps/{map_id}:check, :analyze and :update, /v1/analyze, /v1/maps:apply."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Annotated

from fastapi import APIRouter, Query, Response

from association import MapIndex
from linefix.documents import examples
from linefix.documents.analysis import AnalyzeAnswer, AnalyzeRequest, MapAnalyzeRequest
from linefix.documents.checks import CheckAnswer
from linefix.documents.parts import InlineMap, StoredMap
from linefix.documents.requests import NO_SAMPLES, CheckRequest
from linefix.documents.updates import ApplyAnswer, ApplyRequest, UpdateAnswer, UpdateRequest
from linefix.operations import Steps, analysis_steps, applied, check_steps, update_steps, worked

from ...maps.lookup import FoundMaps
from ..bodies import read
from ..exchange import Admitted, Exchange, MapIdPath
from ..openapi import PROBLEM, takes
from ..stages import index, look_up_map

router = APIRouter(tags=["maps"], responses=PROBLEM)
Operation = Callable[[MapIndex, FoundMaps], Steps]
"""Give the steps of an operation on a map, with its index."""


@router.post("/v1/maps/{map_id}:analyze", **takes(AnalyzeRequest, AnalyzeAnswer, {"a robot": examples.ANALYZE}))
async def analyze_map(exchange: Admitted, map_id: MapIdPath) -> Response:
    """Analyze a stored map.

    Simulate scans on a grid of poses and report where localization succeeds.
    """
    return await _analyze(exchange, StoredMap(map_id=map_id), await read(exchange, AnalyzeRequest))


@router.post("/v1/analyze", **takes(MapAnalyzeRequest, AnalyzeAnswer, {"a room": examples.ANALYZE_ROOM}))
async def analyze(exchange: Admitted) -> Response:
    """Analyze a map that comes with the request.

    Simulate scans on a grid of poses of a map in the request.
    """
    asked = await read(exchange, MapAnalyzeRequest)
    return await _analyze(exchange, asked.map, asked)


async def _analyze(exchange: Exchange, on: InlineMap | StoredMap, asked: AnalyzeRequest) -> Response:
    return await _answer(exchange, on, lambda index, _: analysis_steps(index, asked, exchange.deadline), asked)


@router.get("/v1/maps/{map_id}:check", response_model=CheckAnswer)
async def check_map(
    exchange: Admitted,
    map_id: MapIdPath,
    deadline_ms: Annotated[
        float | None,
        Query(ge=0.0, le=600_000.0, description="milliseconds; parts that it leaves no time for are omitted"),
    ] = None,
) -> Response:
    """Check a map.

    Check a map: its directions, its drawing, its size, and its similar places.
    """
    exchange.services.gate.enter(exchange.ticket)
    asked = NO_SAMPLES.model_copy(update={"deadline_ms": deadline_ms})
    return await _check(exchange, map_id, asked)


@router.post("/v1/maps/{map_id}:check", **takes(CheckRequest, CheckAnswer, {"two scans": examples.CHECK}))
async def check_map_with_scans(exchange: Admitted, map_id: MapIdPath) -> Response:
    """Check a map with sample scans.

    Check a map, and whether sample scans fit better mirrored, undirected, scaled or moved.
    """
    return await _check(exchange, map_id, await read(exchange, CheckRequest))


async def _check(exchange: Exchange, map_id: str, asked: CheckRequest) -> Response:
    def steps(index: MapIndex, source: FoundMaps) -> Steps:
        # An index of its own: one without directions, which a check may add to it, goes with the check, for the cache
        # does not count it.
        return check_steps(replace(index), source.maps[None].oriented, asked, exchange.deadline)

    return await _answer(exchange, StoredMap(map_id=map_id), steps, asked, oriented=True)


@router.post("/v1/maps/{map_id}:update", **takes(UpdateRequest, UpdateAnswer, {"two visits": examples.UPDATE}))
async def update_map(exchange: Admitted, map_id: MapIdPath) -> Response:
    """Propose changes of a stored map.

    Propose changes of a map that scans of several visits show; nothing is stored.
    """
    asked = await read(exchange, UpdateRequest)

    def steps(index: MapIndex, source: FoundMaps) -> Steps:
        old = exchange.services.lookup.document(source.maps[None], source.document)
        return update_steps(index, old, asked, exchange.deadline)

    return await _answer(exchange, StoredMap(map_id=map_id), steps, asked, name="based_on")


@router.post("/v1/maps:apply", **takes(ApplyRequest, ApplyAnswer, {"a rack is gone": examples.APPLY}))
async def apply_changes(exchange: Admitted) -> Response:
    """Apply the accepted changes of an update.

    Return a map with those changes of an update that are accepted; nothing is searched or stored.
    """
    asked = await read(exchange, ApplyRequest)

    def work() -> bytes:
        return exchange.encoded({**applied(asked, exchange.watch), "client_ref": asked.client_ref})

    return await exchange.answer(work)


async def _answer(
    exchange: Exchange,
    on: InlineMap | StoredMap,
    operation: Operation,
    asked: AnalyzeRequest | CheckRequest | UpdateRequest,
    *,
    oriented: bool | None = None,
    name: str = "map",
) -> Response:
    """Answer with an operation on a map; `name` is that of the map's reference."""
    exchange.limit(asked.deadline_ms)
    source = await look_up_map(exchange, on, oriented=oriented)
    ready = await index(exchange, source, oriented=oriented)
    reference = source.references[None]

    def work() -> bytes:
        assert isinstance(ready.maps, MapIndex)
        found = worked(operation(ready.maps, source), exchange.watch, exchange.deadline)
        return exchange.encoded({**found, name: reference, "client_ref": asked.client_ref}, map=reference)

    return await exchange.answer(work, exchange.services.operations)
