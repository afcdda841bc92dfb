"""Probes, counts, limits and version: never shed, never behind a pool of threads that requests can fill."""

from __future__ import annotations

from fastapi import APIRouter, Response

from linefix.documents.encoding import encode

from ...version import VERSION
from ..answers import Limits, Live, Version
from ..exchange import Admitted
from ..openapi import EVERYWHERE, problems
from ..sending import json_response

router = APIRouter(tags=["operations"])


@router.get("/livez", response_model=Live, responses=problems("internal"), summary="Report that the process is alive")
async def livez() -> Response:
    """Answer as long as the event loop turns."""
    return json_response(b'{"status":"ok"}')


@router.get(
    "/readyz",
    response_model=Live,
    responses=problems("internal", "not_ready", "read_only"),
    summary="Report whether the service is ready for requests",
)
async def readyz(exchange: Admitted) -> Response:
    """Answer 200 while the kernels are loaded, the store responds, and the service is not shutting down."""
    await exchange.services.readiness.require_all()
    return json_response(b'{"status":"ok"}')


@router.get("/version", response_model=Version, responses=problems("internal"), summary="Return the version")
async def version() -> Response:
    """Name the version of the service and of its contract."""
    return json_response(encode({"name": "linefix", "version": VERSION, "api": "v1"}))


@router.get(
    "/v1/limits", response_model=Limits, responses=problems(*EVERYWHERE), summary="Return the limits of requests"
)
async def limits(exchange: Admitted) -> Response:
    """Name the limits beyond which a request is refused with 413, or waits no longer."""
    settings = exchange.services.settings
    names = [name for name in Limits.model_fields if name in type(settings).model_fields]
    fixed = {"max_magnitude": 1e9, "min_segment_length": 1e-6, "max_segment_length": 1e4, "max_map_extent": 1e5}
    held = exchange.services.limits
    fixed |= {f"max_{name}": getattr(held, name) for name in ("views", "beams_together", "segments_together")}
    return json_response(encode({name: getattr(settings, name) for name in names} | fixed))


@router.get(
    "/metrics",
    response_class=Response,
    responses={
        200: {"description": "Prometheus text", "content": {"text/plain": {"schema": {"type": "string"}}}},
        **problems("internal"),
    },
    summary="Counts for Prometheus",
)
async def metrics(exchange: Admitted) -> Response:
    """Give the counts, over all workers."""
    text = await exchange.services.metrics.exposition()
    return Response(text, media_type="text/plain; version=0.0.4; charset=utf-8")
