"""/v1/maps: maps stored by id."""

from __future__ import annotations

from functools import partial
from typing import Annotated, Any

from fastapi import APIRouter, Query, Response

from linefix.documents import examples
from linefix.documents.encoding import encode
from linefix.documents.parts import MapDocument
from linefix.documents.reading import read_map

from ...maps.lookup import outline_of
from ..answers import MapList, MapSummaryAnswer
from ..bodies import read_by
from ..etags import demands_of, etag
from ..exchange import Admitted, MapIdPath
from ..openapi import PROBLEM, takes
from ..stages import ask_store

router = APIRouter(tags=["maps"], responses=PROBLEM)
ETAG: dict[str, Any] = {"ETag": {"description": "the revision in quotes", "schema": {"type": "string"}}}
DEMANDS = {
    "If-Match": "revisions, one of which must be the present one; * for any",
    "If-None-Match": "revisions, none of which may be the present one; * for none at all",
}


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
    demands = demands_of(exchange.headers)
    services = exchange.services
    asked, document = await read_by(exchange, read_map)
    outline = await services.parse_threads.run(partial(outline_of, asked))
    put = partial(services.store.put, map_id, document, outline, demands, exchange.ticket.maps)
    revision, created = await ask_store(exchange, put)
    services.metrics.map_changes.labels("created" if created else "replaced").inc()
    exchange.note(map={"map_id": map_id, "revision": revision})
    answer = encode(outline.as_json(map_id, revision))
    return exchange.json(answer, 201 if created else 200, {"ETag": etag(revision)})


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
        if known.strip() == "*" or etag(record.revision) in known:
            return Response(status_code=304, headers={"ETag": etag(record.revision)})
    stored = await ask_store(exchange, partial(services.store.load, map_id))
    return exchange.json(stored.document, headers={"ETag": etag(stored.record.revision)})


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
    demands = demands_of(exchange.headers)
    services = exchange.services
    await ask_store(exchange, partial(services.store.delete, map_id, demands))
    services.metrics.map_changes.labels("deleted").inc()
    exchange.note(map={"map_id": map_id})
    return Response(status_code=204)
