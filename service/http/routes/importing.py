"""POST /v1/maps:import: the map of another tool, read and not stored."""

from __future__ import annotations

from functools import partial
from typing import Any

from fastapi import APIRouter, Request, Response

from ...importing.bounded import read_apart
from ...parsing.reading import read_model
from ...schemas.imports import FORM as SCHEMA
from ...schemas.imports import ImportAnswer
from ...schemas.parts import InlineMap
from ...work.importing import answer_import, index_import
from ...work.job import Done, Job
from ..bodies import FORM
from ..exchange import Exchange, begin_search
from ..receiving import parse, receive
from ..searching import in_slot, in_slot_of
from ..sending import answer
from .declaring import EVERYWHERE, READS_BODY, SEARCHES, problems

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
    """Convert files of another tool to a map, and report conversions and findings; nothing is stored."""
    exchange = begin_search(request)
    async with receive(exchange, form=True) as content:
        job = exchange.job()
        work = _work(exchange, content, request.headers.get("content-type", ""), job)
        return await answer(exchange, work, job.deadline)


async def _work(exchange: Exchange, content: bytearray, content_type: str, job: Job) -> Done:
    """Read the files and index the map in slots of their own, and check it in a slot of a search.

    Meanwhile searches have all the slots at the gate.
    """
    services, deadline = exchange.services, job.deadline
    reading = partial(read_apart, content, content_type, services.import_bounds, deadline)
    read = await in_slot_of(services.importing, exchange, reading, deadline)
    job.watch.lap("read")
    line_map = await parse(exchange, partial(read_model, InlineMap), read.map, deadline)
    indexing = partial(index_import, services.lookup, line_map, deadline)
    index = await in_slot_of(services.indexing, exchange, indexing, deadline)
    return await in_slot(exchange, partial(answer_import, index, line_map, read, job), deadline)
