"""POST /v1/maps:import and /v1/scans:import: files of other tools, read and not stored."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

from fastapi import APIRouter, Response

from linefix.documents.errors import DeadlinePassedError
from linefix.documents.parts import InlineMap
from linefix.documents.reading import read_model
from linefix.documents.strict import descriptions_of

from ...errors import ImportTooLateError
from ...importing.bounded import ReadFiles, read_apart
from ...importing.fields import CHOICES, MapForm, ScansForm
from ...work.results import answer_import, answer_scans, index_import
from ..answers import ImportAnswer, ScansAnswer
from ..bodies import FORM, parse, receive
from ..exchange import Admitted, Exchange
from ..openapi import PROBLEM, takes_content

router = APIRouter(tags=["maps"], responses=PROBLEM)


def _takes(form: type[MapForm | ScansForm]) -> dict[str, Any]:
    """Return the documentation of a form with files and fields, which its docstring describes."""
    files = (form.__doc__ or "").partition(".\n")[0]
    content = {"type": "array", "minItems": 1, "items": {"type": "string", "format": "binary"}, "description": files}
    fields = {
        name: ({"enum": CHOICES[name]} if name in CHOICES else {"type": "string"}) | {"description": text}
        for name, text in descriptions_of(form).items()
    }
    taken = {"required": ["file"], "additionalProperties": False, "properties": {"file": content, **fields}}
    described = "A form with files. May be gzip (Content-Encoding)."
    return takes_content(FORM, {"schema": {"type": "object", **taken}}, described)


@router.post("/v1/maps:import", response_model=ImportAnswer, openapi_extra=_takes(MapForm))
async def import_map(exchange: Admitted) -> Response:
    """Read the map of another tool.

    Convert files of another tool to a map, and report conversions and findings; nothing is stored.
    """

    async def work(read: ReadFiles) -> Response:
        """Index the map in a slot of its own, and check it in one of an operation; searches go before both."""
        exchange.watch.lap("read")
        services = exchange.services
        line_map = await parse(exchange, partial(read_model, InlineMap), read.content)
        indexing = partial(index_import, services.lookup, line_map, exchange.deadline)
        index = await exchange.run(indexing, services.indexing)
        return await exchange.answer(partial(answer_import, index, line_map, read, exchange), services.operations)

    return await _import(exchange, work)


@router.post("/v1/scans:import", response_model=ScansAnswer, openapi_extra=_takes(ScansForm))
async def import_scans(exchange: Admitted) -> Response:
    """Read scans of a log.

    Read some scans of a bag or another log, evenly spread; nothing is stored.
    """
    gate = exchange.services.operations
    return await _import(
        exchange, lambda read: exchange.answer(partial(answer_scans, read, exchange), gate), scans=True
    )


async def _import(
    exchange: Exchange, work: Callable[[ReadFiles], Awaitable[Response]], *, scans: bool = False
) -> Response:
    """Have a form read in a slot of imports, and answer with what `work` makes of its files."""
    services = exchange.services
    with services.bodies.account(exchange.ticket.holder) as take:
        content = await receive(exchange, take, FORM)
        kind = exchange.headers.get("content-type", "")
        reading = partial(read_apart, content, kind, services.import_bounds, exchange.deadline, scans=scans)
        try:
            return await work(await exchange.run(reading, services.importing))
        except DeadlinePassedError:  # it is no search that has not begun
            raise ImportTooLateError from None
