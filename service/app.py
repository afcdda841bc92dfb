"""The application: its parts, its layers, its routes."""

from __future__ import annotations

import asyncio
import gc
import logging
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from functools import cache, partial
from typing import Any

from fastapi import FastAPI
from fastapi.exceptions import RequestValidationError
from fastapi.routing import APIRoute
from starlette.exceptions import HTTPException
from starlette.middleware.cors import CORSMiddleware

from compiled import compiled_fraction, is_complete
from linefix.compiling import start_compiler
from linefix.documents.encoding import encode
from linefix.warmup import warm_up

from .errors import StoreError
from .http.middleware import RequestMiddleware
from .http.openapi import describe
from .http.problems import raise_ours
from .http.routes import importing, maps, operations, pages, quality, scans
from .importing.folders import remove_abandoned
from .memory import return_free_pages
from .services import Services
from .settings import Settings
from .telemetry.metrics import REFRESH_SECONDS
from .version import VERSION

logger = logging.getLogger("linefix")
Started = Callable[[Services], None]
KEYS_SECONDS = 1.0  # between looks whether keys have changed
PROGRESS_SECONDS = 2.0  # between two counts of the compiled kernels


def create_app(settings: Settings, started: Started | None = None) -> FastAPI:
    """Return an application that has not started anything yet.

    Parameters
    ----------
    settings : Settings
    started : callable, optional
        Called with the application's parts, in its event loop, when it starts.
    """
    services = Services(settings)
    app = FastAPI(
        title="Linefix",
        version=VERSION,
        openapi_url=None,  # the pages give it, rendered once
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        exception_handlers=dict.fromkeys((HTTPException, RequestValidationError), raise_ours),
        telemetry={"tracing": False, "metrics": False, "logs": False},  # it would look for a set-up at each request
        lifespan=partial(_lifespan, services=services, started=started),
    )
    app.state.services = services
    # Made on the first request for it: that takes some tenths of a second.
    app.state.contract = cache(lambda: encode(describe(app, guarded=settings.guarded)))
    # In the order in which they are tried: robots come most often, and the paths of what is done with a map are also
    # those of a map. An included router would be one more layer for each of them.
    for module in (scans, quality, importing, maps, operations, pages):
        app.router.routes.extend(module.router.routes)
    for route in app.router.routes:
        if isinstance(route, APIRoute):
            route.operation_id = route.name  # generated clients name their functions so
            summary, _, route.description = route.description.partition("\n\n")
            route.summary = summary.removesuffix(".")
    routes = frozenset(getattr(route, "path", "") for route in app.routes)
    app.add_middleware(RequestMiddleware, services=services, routes=routes)
    if settings.cors_origins:  # outside of it: a page may read refusals, too
        app.add_middleware(
            CORSMiddleware,
            allow_origins=settings.cors_origins,
            allow_methods=("GET", "POST", "PUT", "DELETE"),
            allow_headers=(
                "Authorization",
                "Content-Encoding",
                "Content-Type",
                "If-Match",
                "If-None-Match",
                "X-Request-Id",
            ),
            expose_headers=("ETag", "Retry-After", "X-Request-Id"),
        )
    return app


@asynccontextmanager
async def _lifespan(app: FastAPI, services: Services, started: Started | None) -> AsyncIterator[None]:
    refresh_keys = partial(services.key_threads.run, services.keyring.refresh)
    getting_ready, *repeating = map(
        asyncio.create_task,
        (
            _get_ready(services),
            _repeat(REFRESH_SECONDS, services.metrics.refreshed),  # for requests that reach another worker
            _repeat(KEYS_SECONDS, refresh_keys),  # keys come and go without a restart
        ),
    )
    if started is not None:
        started(services)
    if is_complete():  # no request comes to a process that has to refuse it; a first start answers probes meanwhile
        await getting_ready
    try:
        yield
    finally:
        for task in (getting_ready, *repeating):
            task.cancel()
        services.close()


async def _get_ready(services: Services) -> None:
    """Open the store and warm the kernels while probes are answered already; a defect in that is logged."""
    try:
        await _prepare(services)
    except Exception:
        logger.exception("a defect: the service does not become ready")
        raise


async def _prepare(services: Services) -> None:
    try:
        await services.readiness.open_store()
    except StoreError as error:
        # readyz goes on trying; meanwhile it reports the error.
        where = services.settings.url.render_as_string(hide_password=True)
        logger.error(
            "the store does not open: %s; /readyz returns 503 until it does. Check the database, or the data folder",
            error,
            extra={"store": where},
        )
    threads = services.parse_threads
    await threads.run(remove_abandoned)
    if not is_complete():
        await _compile(services)
    await threads.run(warm_up)
    # Objects made until now live as long as the process: the garbage collector need not look through them, ever. It has
    # been off since the process began, which saves a fifth of the start; hardly any of these objects is garbage.
    gc.freeze()
    gc.enable()
    return_free_pages()
    services.readiness.warm = True
    services.metrics.refresh()
    logger.info("ready")


async def _compile(services: Services) -> None:
    """Compile the kernels in a process that ends with it, and log the progress."""
    logger.info("compiling the kernels, which takes one to two minutes; later starts load them from the cache")

    async def follow() -> None:
        services.readiness.compiled = fraction = await services.store_threads.run(compiled_fraction)
        logger.info("compiling", extra={"share": round(fraction, 2)})

    following, compiler = asyncio.create_task(_repeat(PROGRESS_SECONDS, follow)), start_compiler()
    try:
        await services.parse_threads.run(compiler.wait)  # if it ends early, this process compiles the missing kernels
    finally:
        following.cancel()
        compiler.kill()
    services.readiness.compiled = None


async def _repeat(seconds: float, call: Callable[[], Coroutine[Any, Any, None]]) -> None:
    """Call now and then, also after a defect."""
    while True:
        try:
            await call()
        except Exception:
            logger.exception("a defect")
        await asyncio.sleep(seconds)
