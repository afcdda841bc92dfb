"""POST /v1/maps:import and /v1/scans:import: files of other tools, read and not stored."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from functools import partial
from typing import Any

from fastapi import APIRouter, Response

from linefix.documents.parts import InlineMap
from linefix.documents.reading import read_model

from ...admission.errors import DeadlinePassedError
from ...importing.bounded import ReadScans, read_apart, read_scans_apart
from ...importing.errors import TooLateError
from ...importing.fields import MAP_FORM, SCANS_FORM
from ...work.importing import answer_import, answer_scans, index_import
from ...work.job import Done, Job
from ..answers import ImportAnswer, ScansAnswer
from ..bodies import FORM
from ..body_stage import parse, receive
from ..exchange import Exchange, Searching
from ..openapi import EVERYWHERE, READS_BODY, SEARCHES, problems
from ..search_stage import in_search_slot, in_slot_of
from ..sending import answer

router = APIRouter(tags=["maps"])
_PROBLEMS = problems(*EVERYWHERE, *(code for code in READS_BODY if code != "invalid_json"), *SEARCHES)


def _takes(schema: dict[str, Any]) -> dict[str, Any]:
    description = "A form with files. May be gzip (Content-Encoding)."
    return {"requestBody": {"required": True, "description": description, "content": {FORM: {"schema": schema}}}}


@router.post(
    "/v1/maps:import",
    operation_id="import_map",
    response_model=ImportAnswer,
    responses=_PROBLEMS,
    openapi_extra=_takes(MAP_FORM),
    summary="Read the map of another tool",
)
async def post_import(exchange: Searching) -> Response:
    """Convert files of another tool to a map, and report conversions and findings; nothing is stored."""
    async with receive(exchange, form=True) as content:
        job = exchange.job()
        work = _work(exchange, content, exchange.request.headers.get("content-type", ""), job)
        return await _in_time(exchange, work, job)


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
    return await in_search_slot(exchange, partial(answer_import, index, line_map, read, job), deadline)


async def _in_time(exchange: Exchange, work: Coroutine[Any, Any, Done], job: Job) -> Response:
    try:
        return await answer(exchange, work, job.deadline)
    except DeadlinePassedError:  # it is no search that has not begun
        raise TooLateError from None


@router.post(
    "/v1/scans:import",
    operation_id="import_scans",
    response_model=ScansAnswer,
    responses=_PROBLEMS,
    openapi_extra=_takes(SCANS_FORM),
    summary="Read scans of a log",
)
async def post_scans(exchange: Searching) -> Response:
    """Read some scans of a bag or another log, evenly spread; nothing is stored."""
    async with receive(exchange, form=True) as content:
        job = exchange.job()
        content_type = exchange.request.headers.get("content-type", "")
        reading = partial(read_scans_apart, content, content_type, exchange.services.import_bounds, job.deadline)
        work = _scans(exchange, reading, job)
        return await _in_time(exchange, work, job)


async def _scans(exchange: Exchange, reading: Callable[[], ReadScans], job: Job) -> Done:
    """Read scans in a slot of imports, and write them in one of searches."""
    read = await in_slot_of(exchange.services.importing, exchange, reading, job.deadline)
    return await in_search_slot(exchange, partial(answer_scans, read, job), job.deadline)
