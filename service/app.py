"""The application: its parts, its layers, its routes."""

from __future__ import annotations

import asyncio
import gc
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect
from starlette.responses import Response
from starlette.routing import Match

from association import CancelledError
from registration import InputError

from .admission.keys import KeyGuard
from .http.openapi import describe
from .http.problems import ProblemError, faults_of, internal, invalid
from .http.reception import RequestContext, note, request_id_of
from .http.routes import associate, maps, operations, pages, register, vectorize
from .http.translation import problem_of
from .process.compiling import compile_kernels, is_compiled
from .process.part import WHOLE, Part
from .process.warmup import warm_up
from .runtime import HangUpError, Runtime
from .schemas.strict import TooLargeError
from .settings import Settings
from .version import VERSION

logger = logging.getLogger("linefix")
CLIENT_CLOSED_REQUEST = 499  # nobody reads it; the log and the counts do


def create_app(settings: Settings, part: Part = WHOLE) -> FastAPI:
    """Return an application that has not started anything yet.

    Parameters
    ----------
    settings : Settings
    part : Part
        Which of several processes this is.
    """
    runtime = Runtime(settings, part)
    app = FastAPI(
        title="Linefix",
        version=VERSION,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        lifespan=partial(_lifespan, runtime=runtime, part=part),
    )
    app.state.runtime = runtime
    for module in (register, associate, vectorize, maps, operations, pages):
        app.include_router(module.router)
    for kind in (
        ProblemError,
        TooLargeError,
        InputError,
        CancelledError,
        RequestValidationError,
        HTTPException,
    ):
        app.add_exception_handler(kind, _refuse)
    for gone in (HangUpError, ClientDisconnect):
        app.add_exception_handler(gone, _nobody)
    # The last added is the outermost.
    app.add_middleware(KeyGuard, keyring=runtime.keyring)
    app.add_middleware(RequestContext, metrics=runtime.metrics)
    document: dict[str, Any] = {}

    def openapi() -> dict[str, Any]:
        if not document:
            document.update(describe(app))
        return document

    app.openapi = openapi  # type: ignore[method-assign]
    return app


@asynccontextmanager
async def _lifespan(app: FastAPI, runtime: Runtime, part: Part) -> AsyncIterator[None]:
    tasks = [asyncio.create_task(_get_ready(runtime)), asyncio.create_task(runtime.metrics.refresh_now_and_then())]
    if part.replaces:
        await tasks[0]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        runtime.doors.report()
        runtime.close()


async def _get_ready(runtime: Runtime) -> None:
    """Open the store and warm the kernels while probes are answered already."""
    try:
        await runtime.open_store()
    except ProblemError as problem:
        # readyz goes on trying; meanwhile it says what is wrong.
        where = runtime.settings.url.render_as_string(hide_password=True)
        logger.error("the store does not open: %s", problem.detail, extra={"store": where})
    if not is_compiled():
        logger.info("compiling, which takes half a minute; what comes of it is kept for the next start")
        with suppress(ProblemError):  # if that process ends early this one compiles what is missing
            await runtime.in_parser(partial(runtime.parser.call, compile_kernels))
        runtime.parser.close()
    await asyncio.gather(runtime.in_parser(warm_up), runtime.in_parser(runtime.parser.start))
    # What is there now stays: no need to look through it for garbage ever again.
    gc.collect()
    gc.freeze()
    runtime.warm = True
    runtime.metrics.refresh()
    logger.info("ready")


async def _refuse(request: Request, error: Exception) -> Response:
    problem = _of_framework(request, error) or problem_of(error)
    if problem is None:
        logger.error("a defect", exc_info=error, extra={"request_id": request_id_of(request.scope)})
        problem = internal()
    note(request.scope, code=problem.code)
    return problem.response(request_id_of(request.scope))


def _of_framework(request: Request, error: Exception) -> ProblemError | None:
    """Return the problem of what FastAPI and Starlette refuse by themselves."""
    if isinstance(error, RequestValidationError):
        return invalid(faults_of(error.errors()))
    if isinstance(error, HTTPException):
        headers = dict(error.headers or {})
        if error.status_code == 405:
            headers["Allow"] = ", ".join(_methods_of(request))
            return ProblemError("method_not_allowed", "this path takes other methods; see Allow", headers=headers)
        if error.status_code == 404:
            return ProblemError("not_found", "there is nothing under this path", headers=headers)
        return ProblemError("invalid_request", "the request is wrong", headers=headers)
    return None


def _methods_of(request: Request) -> list[str]:
    """Return what the path takes; the framework names the methods of one route only."""
    every = [getattr(included, "original_router", None) or included for included in request.app.routes]
    routes = [route for one in every for route in getattr(one, "routes", [one])]
    matching = (route for route in routes if route.matches(request.scope)[0] is not Match.NONE)
    methods = {method for route in matching for method in getattr(route, "methods", ())}
    return sorted(methods | {"HEAD"} if "GET" in methods else methods)


async def _nobody(request: Request, error: Exception) -> Response:
    return Response(status_code=CLIENT_CLOSED_REQUEST)
