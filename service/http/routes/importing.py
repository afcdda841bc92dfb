"""POST /v1/maps:import and /v1/scans:import: files of other tools, read and not stored."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

from fastapi import APIRouter, Response

from linefix.documents.errors import DeadlinePassedError
from linefix.documents.parts import InlineMap
from linefix.documents.reading import read_model

from ...errors import ImportTooLateError
from ...importing.bounded import ReadFiles, read_apart
from ...importing.fields import MAP_FORM, SCANS_FORM
from ...work.job import Done, Job
from ...work.results import answer_import, answer_scans, index_import
from ..answers import ImportAnswer, ScansAnswer
from ..bodies import FORM, parse, receive
from ..exchange import Exchange, Searching
from ..openapi import EVERYWHERE, READS_BODY, SEARCHES, problems
from ..search_stage import in_search_slot
from ..sending import answer

router = APIRouter(tags=["maps"])
_PROBLEMS = problems(*EVERYWHERE, *(code for code in READS_BODY if code != "invalid_json"), *SEARCHES)


def _takes(schema: dict[str, Any]) -> dict[str, Any]:
    description = "A form with files. May be gzip (Content-Encoding)."
    return {"requestBody": {"required": True, "description": description, "content": {FORM: {"schema": schema}}}}


@router.post(
    "/v1/maps:import",
    response_model=ImportAnswer,
    responses=_PROBLEMS,
    openapi_extra=_takes(MAP_FORM),
    summary="Read the map of another tool",
)
async def import_map(exchange: Searching) -> Response:
    """Convert files of another tool to a map, and report conversions and findings; nothing is stored."""

    async def work(read: ReadFiles, job: Job) -> Done:
        """Index the map in a slot of its own, and check it in one of a search; searches go before both."""
        job.watch.lap("read")
        services, deadline = exchange.services, job.deadline
        line_map = await parse(exchange, partial(read_model, InlineMap), read.content, deadline)
        indexing = partial(index_import, services.lookup, line_map, deadline)
        index = await services.indexing.run(indexing, deadline, exchange.ticket)
        return await in_search_slot(exchange, partial(answer_import, index, line_map, read, job), deadline)

    return await _import(exchange, work)


@router.post(
    "/v1/scans:import",
    response_model=ScansAnswer,
    responses=_PROBLEMS,
    openapi_extra=_takes(SCANS_FORM),
    summary="Read scans of a log",
)
async def import_scans(exchange: Searching) -> Response:
    """Read some scans of a bag or another log, evenly spread; nothing is stored."""

    async def work(read: ReadFiles, job: Job) -> Done:
        return await in_search_slot(exchange, partial(answer_scans, read, job), job.deadline)

    return await _import(exchange, work, scans=True)


async def _import(
    exchange: Exchange, work: Callable[[ReadFiles, Job], Awaitable[Done]], *, scans: bool = False
) -> Response:
    """Have a form read in a slot of imports, and answer with what `work` makes of its files."""
    services = exchange.services
    async with receive(exchange, form=True) as content:
        job, kind = exchange.job(), exchange.request.headers.get("content-type", "")
        reading = partial(read_apart, content, kind, services.import_bounds, job.deadline, scans=scans)

        async def whole() -> Done:
            return await work(await services.importing.run(reading, job.deadline, exchange.ticket), job)

        try:
            return await answer(exchange, whole(), job.deadline)
        except DeadlinePassedError:  # it is no search that has not begun
            raise ImportTooLateError from None
