"""Probes, counts, limits and version: never shed, never behind a pool of threads that requests can fill."""

from __future__ import annotations

import asyncio

from fastapi import APIRouter, Request, Response

from ...runtime import runtime_of
from ...schemas.encoding import encode
from ...schemas.replies import Limits, Live, Version
from ...version import VERSION
from ..problems import ProblemError
from .answering import EVERYWHERE, json_response, problems

router = APIRouter(tags=["operations"])
STORE_ANSWERS_WITHIN = 2.0  # s


@router.get("/livez", response_model=Live, responses=problems("internal"), summary="Is the process alive?")
async def livez() -> Response:
    """Answer as long as the event loop turns."""
    return json_response(b'{"status":"ok"}')


@router.get(
    "/readyz",
    response_model=Live,
    responses=problems("internal", "not_ready", "read_only"),
    summary="Send it requests?",
)
async def readyz(request: Request) -> Response:
    """Answer 200 once the kernels are warm and the store answers, and until the service is told to end."""
    runtime = runtime_of(request)
    if runtime.draining:
        raise ProblemError("not_ready", "the service is going down")
    if not runtime.warm:
        raise ProblemError("not_ready", "the kernels are being compiled")
    try:
        async with asyncio.timeout(STORE_ANSWERS_WITHIN):
            await runtime.check_store()
    except TimeoutError:
        raise ProblemError("not_ready", "the store does not answer") from None
    except ProblemError as problem:
        # A full, busy or damaged store is for the callers of maps to know; to a balancer it is all the same.
        if problem.status == 503:
            raise
        raise ProblemError("not_ready", problem.detail) from problem
    return json_response(b'{"status":"ok"}')


@router.get("/version", response_model=Version, responses=problems("internal"), summary="Which version is this?")
async def version() -> Response:
    """Name the version of the service and of its contract."""
    return json_response(encode({"name": "linefix", "version": VERSION, "api": "v1"}))


@router.get("/v1/limits", response_model=Limits, responses=problems(*EVERYWHERE), summary="What is too much?")
async def limits(request: Request) -> Response:
    """Name the limits beyond which a request is refused with 413, or waits no longer."""
    settings = runtime_of(request).settings
    names = (
        "max_body_bytes",
        "max_values",
        "max_bodies_bytes",
        "request_timeout",
        "max_map_segments",
        "max_scan_segments",
        "max_beams",
        "max_correspondences",
    )
    more = ("max_batch", "max_deadline_ms", "searches", "queue")
    fixed = {"max_magnitude": 1e9, "min_segment_length": 1e-6, "max_segment_length": 1e4, "max_map_extent": 1e5}
    return json_response(encode({name: getattr(settings, name) for name in (*names, *more)} | fixed))


@router.get(
    "/metrics",
    response_class=Response,
    responses={
        200: {"description": "Prometheus text", "content": {"text/plain": {"schema": {"type": "string"}}}},
        **problems("internal"),
    },
    summary="Counts for Prometheus",
)
async def metrics(request: Request) -> Response:
    """Give the counts, over all workers."""
    text = runtime_of(request).metrics.exposition()
    return Response(text, media_type="text/plain; version=0.0.4; charset=utf-8")
