"""/v1/maps: maps stored by id; the entity tag of one is its revision in quotes."""

from __future__ import annotations

import re
from collections.abc import Container
from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response
from starlette.datastructures import Headers

from linefix.documents import examples
from linefix.documents.encoding import encode
from linefix.documents.errors import Fault, InvalidRequestError
from linefix.documents.parts import MapDocument
from linefix.documents.reading import read_map

from ...maps import EVERY_REVISION, Preconditions
from ...maps.lookup import outline_of
from ..answers import MapList, MapSummaryAnswer
from ..bodies import read_by
from ..exchange import Admitted, MapIdPath
from ..openapi import PROBLEM, takes
from ..stages import ask_store

router = APIRouter(tags=["maps"], responses=PROBLEM)
ETAG: dict[str, Any] = {"ETag": {"description": "the revision in quotes", "schema": {"type": "string"}}}
DEMANDS = {
    "If-Match": "revisions, one of which must be the present one; * for any",
    "If-None-Match": "revisions, none of which may be the present one; * for none at all",
}

_TAG = re.compile(r'(W/)?"([^"]*)"')
_REVISION = re.compile(r"[1-9][0-9]{0,17}")


def _conditional(*names: str) -> dict[str, Any]:
    text = {"in": "header", "required": False, "schema": {"type": "string"}}
    return {"parameters": [{"name": name, "description": DEMANDS[name], **text} for name in names]}


@router.put(
    "/v1/maps/{map_id}",
    **takes(MapDocument, MapSummaryAnswer, {"a room": examples.MAP}, **_conditional("If-Match", "If-None-Match")),
    responses={
        200: {"description": "A new revision", "headers": ETAG},
        201: {"description": "A new map", "headers": ETAG, "model": MapSummaryAnswer},
    },
)
async def put_map(exchange: Admitted, map_id: MapIdPath) -> Response:
    """Store a map.

    Store a map durably: after the answer it survives the loss of process and power.
    """
    demands = _demands_of(exchange.headers)
    services = exchange.services
    asked, document = await read_by(exchange, read_map)
    outline = await services.parse_threads.run(partial(outline_of, asked))
    put = partial(services.store.put, map_id, document, outline, demands, exchange.ticket.maps)
    revision, created = await ask_store(exchange, put)
    services.metrics.map_changes.labels("created" if created else "replaced").inc()
    exchange.note(map={"map_id": map_id, "revision": revision})
    answer = encode(outline.as_json(map_id, revision))
    return exchange.json(answer, 201 if created else 200, {"ETag": _etag(revision)})


@router.get(
    "/v1/maps/{map_id}",
    response_model=MapDocument,
    responses={
        200: {"description": "The map as it was stored, to the bit", "headers": ETAG},
        304: {"description": "The caller has this revision", "headers": ETAG},
    },
    openapi_extra=_conditional("If-None-Match"),
)
async def get_map(exchange: Admitted, map_id: MapIdPath) -> Response:
    """Get a map.

    Return a map as it was stored.
    """
    services = exchange.services
    if known := exchange.headers.get("if-none-match"):
        record = await ask_store(exchange, partial(services.store.record, map_id))
        if known.strip() == "*" or _etag(record.revision) in known:
            return Response(status_code=304, headers={"ETag": _etag(record.revision)})
    stored = await ask_store(exchange, partial(services.store.load, map_id))
    return exchange.json(stored.document, headers={"ETag": _etag(stored.record.revision)})


@router.get("/v1/maps", response_model=MapList)
async def list_maps(
    exchange: Admitted,
    limit: Annotated[int, Query(ge=1, le=1000, description="maps on one page")] = 100,
    cursor: Annotated[
        str, Query(max_length=128, pattern="^[A-Za-z0-9._-]*$", description="`next` of the page before")
    ] = "",
) -> Response:
    """List the maps.

    List the stored maps, by id.
    """
    services = exchange.services
    page = await ask_store(exchange, partial(services.store.list, limit, cursor, exchange.ticket.maps))
    items = [record.as_json() for record in page.maps]
    return exchange.json(encode({"maps": items, "corrupt": page.corrupt, "next": page.next}))


@router.delete("/v1/maps/{map_id}", status_code=204, response_model=None, openapi_extra=_conditional("If-Match"))
async def delete_map(exchange: Admitted, map_id: MapIdPath) -> Response:
    """Delete a map."""
    demands = _demands_of(exchange.headers)
    services = exchange.services
    await ask_store(exchange, partial(services.store.delete, map_id, demands))
    services.metrics.map_changes.labels("deleted").inc()
    exchange.note(map={"map_id": map_id})
    return Response(status_code=204)


def _etag(revision: int) -> str:
    """Return the strong entity tag of a revision."""
    return f'"{revision}"'


def _demands_of(headers: Headers) -> Preconditions:
    """Return what ``If-Match`` and ``If-None-Match`` of a request demand.

    Raises
    ------
    InvalidRequestError
        When one is not of the form of RFC 9110: taken for no demand it could cost a map.
    """
    # A weak tag never matches strongly: RFC 9110, 8.8.3.2.
    return Preconditions(_revisions(headers, "if-match", weak=False), _revisions(headers, "if-none-match", weak=True))


def _revisions(headers: Headers, name: str, *, weak: bool) -> Container[int] | None:
    """Return the revisions that a header names; None where there is no header."""
    if name not in headers:
        return None
    header = ", ".join(headers.getlist(name)).strip()
    if header == "*":
        return EVERY_REVISION
    if _TAG.sub("", header).strip(" \t,") or not _TAG.search(header):
        message = 'expected * or tags in quotes, such as "3", found other text'  # without a repetition of it
        raise InvalidRequestError([Fault(f"/header/{name}", message)])
    named = (tag for is_weak, tag in _TAG.findall(header) if weak or not is_weak)
    return frozenset(int(tag) for tag in named if _REVISION.fullmatch(tag))
