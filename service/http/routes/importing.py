"""POST /v1/maps:import: the map of another tool, read and not stored."""

from __future__ import annotations

import asyncio
import time
from functools import partial
from typing import Any

from fastapi import APIRouter, Request, Response

from association import Deadline

from ...admission.errors import DeadlinePassedError
from ...importing.bounded import ReadMap, read_apart
from ...importing.bounds import Bounds
from ...parsing.reading import read_model
from ...schemas.imports import FORM as SCHEMA
from ...schemas.imports import ImportAnswer
from ...schemas.parts import InlineMap
from ...work.importing import answer_import
from ...work.job import Done, Job
from ..bodies import FORM
from ..exchange import Exchange, searching
from .documenting import EVERYWHERE, READS_BODY, SEARCHES, problems

router = APIRouter(tags=["maps"])
_TAKES: dict[str, Any] = {
    "requestBody": {
        "required": True,
        "description": "A form with files. May be gzip (Content-Encoding).",
        "content": {FORM: {"schema": SCHEMA}},
    }
}


@router.post(
    "/v1/maps:import",
    operation_id="import_map",
    response_model=ImportAnswer,
    responses=problems(*EVERYWHERE, *(code for code in READS_BODY if code != "invalid_json"), *SEARCHES),
    openapi_extra=_TAKES,
    summary="Read the map of another tool",
)
async def post_import(request: Request) -> Response:
    """Make a map of the files of another tool, say what was done for that and what is doubtful; nothing is stored."""
    exchange = searching(request)
    async with exchange.received(form=True) as content:
        job = exchange.job()
        work = _work(exchange, content, request.headers.get("content-type", ""), job)
        return exchange.answer(await exchange.unless_hung_up(work, job.deadline))


async def _work(exchange: Exchange, content: bytearray, content_type: str, job: Job) -> Done:
    """Read the files in one turn at the gate, and check what came of them in another."""
    services = exchange.services
    settings = services.settings
    bounds = Bounds(settings.max_import_bytes, settings.max_body_bytes, settings.max_map_segments)
    read = await _alone(exchange, partial(read_apart, content, content_type, bounds, job.deadline), job.deadline)
    job.watch.lap("read")
    line_map = await exchange.parse(partial(read_model, InlineMap), read.map, job.deadline)
    check = partial(answer_import, services.lookup, line_map, read, job)
    return await exchange.take_turn(check, job.deadline, job.searching.is_set)


async def _alone(exchange: Exchange, read: partial[ReadMap], deadline: Deadline) -> ReadMap:
    """Read one map at a time: each may take much memory."""
    left = None if deadline.at is None else max(0.0, deadline.at - time.monotonic())
    try:
        async with asyncio.timeout(left):
            await exchange.services.imports.acquire()
    except TimeoutError:
        raise DeadlinePassedError from None
    try:
        return await exchange.take_turn(read, deadline)
    finally:
        exchange.services.imports.release()
