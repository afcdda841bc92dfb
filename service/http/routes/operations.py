"""Probes, counts, limits and version: never shed, never behind a pool of threads that requests can fill."""

from __future__ import annotations

from fastapi import APIRouter, Response
from fastapi.responses import PlainTextResponse

from ...version import VERSION
from ..answers import LIMITS, Limits, Live, Version
from ..exchange import JSON, Admitted
from ..openapi import PROBLEM

router = APIRouter(tags=["operations"], responses=PROBLEM)
OK = b'{"status":"ok"}'


@router.get("/livez", response_model=Live)
async def livez() -> Response:
    """Report that the process is alive.

    Answer as long as the event loop turns.
    """
    return Response(OK, media_type=JSON)


@router.get("/readyz", response_model=Live)
async def readyz(exchange: Admitted) -> Response:
    """Report whether the service is ready for requests.

    Answer 200 while the kernels are loaded, the store responds, and the service is not shutting down.
    """
    await exchange.services.readiness.require_all()
    return Response(OK, media_type=JSON)


@router.get("/version", response_model=Version)
async def version() -> dict[str, str]:
    """Return the version.

    Name the version of the service and of its contract.
    """
    return {"name": "linefix", "version": VERSION, "api": "v1"}


@router.get("/v1/limits", response_model=Limits)
async def limits(exchange: Admitted) -> dict[str, float]:
    """Return the limits of requests.

    Name the limits beyond which a request is refused with 413, or waits no longer.
    """
    settings = exchange.services.settings
    fixed = {"max_magnitude": 1e9, "min_segment_length": 1e-6, "max_segment_length": 1e4, "max_map_extent": 1e5}
    held = exchange.services.limits
    fixed |= {f"max_{name}": getattr(held, name) for name in ("views", "beams_together", "segments_together")}
    return {name: getattr(settings, name) for name in LIMITS} | fixed


@router.get("/metrics", response_class=PlainTextResponse)
async def metrics(exchange: Admitted) -> Response:
    """Return the counts for Prometheus.

    They are those of all workers.
    """
    text = await exchange.services.metrics.exposition()
    return Response(text, media_type="text/plain; version=0.0.4; charset=utf-8")
