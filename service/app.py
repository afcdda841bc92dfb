"""The application: its parts, its layers, its routes."""

from __future__ import annotations

import asyncio
import gc
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from functools import partial
from typing import Any

from fastapi import FastAPI

from .admission.budget import ByteBudget
from .admission.entrance import Entrance
from .admission.gate import SearchGate
from .admission.keys import Keyring
from .admission.readiness import Readiness
from .http.bodies import BodyReceiver
from .http.openapi import describe
from .http.probe import StoreProbe
from .http.reception import Reception
from .http.refusing import handle_errors
from .http.routes import associate, batch, maps, operations, pages, register, vectorize
from .http.services import KEY, Services
from .maps import IndexCache, MapStore
from .maps.errors import StoreError
from .maps.lookup import MapLookup
from .parsing.errors import ParserEndedError
from .parsing.parser_process import ParserProcess
from .part import WHOLE, Part
from .settings import Settings
from .telemetry.metrics import Metrics
from .telemetry.refusals import RefusalTally
from .threads import Threads
from .version import VERSION
from .work.association import Associator
from .work.compiling import compile_kernels, is_compiled
from .work.warmup import warm_up

logger = logging.getLogger("linefix")


def create_app(settings: Settings, part: Part = WHOLE) -> FastAPI:
    """Return an application that has not started anything yet.

    Parameters
    ----------
    settings : Settings
    part : Part
        Which of several processes this is.
    """
    services = _services(settings, part)
    app = FastAPI(
        title="Linefix",
        version=VERSION,
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        lifespan=partial(_lifespan, services=services, part=part),
    )
    app.state.services = services
    for module in (register, associate, batch, vectorize, maps, operations, pages):
        app.include_router(module.router)
    handle_errors(app)
    app.add_middleware(Reception, services=services)
    document: dict[str, Any] = {}

    def openapi() -> dict[str, Any]:
        if not document:
            document.update(describe(app))
        return document

    app.openapi = openapi  # type: ignore[method-assign]
    return app


def _services(settings: Settings, part: Part) -> Services:
    """Put the parts together; of several processes each has its share."""
    metrics = Metrics()
    gate = SearchGate(part.share(settings.searches), part.share(settings.queue))
    budget = ByteBudget(max(settings.max_body_bytes, part.share(settings.max_bodies_bytes)))
    store = MapStore(settings.url)
    cache = IndexCache(part.share(settings.cache_bytes), metrics)
    parser = ParserProcess()
    readiness = Readiness()
    metrics.watch("linefix_workers_ready", "Processes that take requests", lambda: readiness.takes_requests)
    metrics.watch("linefix_searches_running", "Searches that run", lambda: gate.running)
    metrics.watch("linefix_searches_waiting", "Searches that wait", lambda: gate.waiting)
    metrics.watch("linefix_bodies_bytes", "Bytes of requests held", lambda: budget.held)
    metrics.watch("linefix_map_cache_bytes", "Bytes of indexed maps held", lambda: cache.bytes)
    metrics.watch("linefix_map_cache_maps", "Indexed maps held", lambda: len(cache))
    return Services(
        settings=settings,
        metrics=metrics,
        refusals=RefusalTally(metrics),
        readiness=readiness,
        entrance=Entrance(gate, Keyring(settings.keys), settings.max_body_bytes),
        gate=gate,
        bodies=BodyReceiver(settings.max_body_bytes, budget, settings.request_timeout),
        parser=parser,
        store=store,
        probe=StoreProbe(store),
        associator=Associator(MapLookup(cache, store, parser), metrics),
        parse_threads=Threads(2, "parse"),
        store_threads=Threads(4, "store"),
    )


@asynccontextmanager
async def _lifespan(app: FastAPI, services: Services, part: Part) -> AsyncIterator[dict[str, Services]]:
    getting_ready = asyncio.create_task(_get_ready(services))
    refreshing = asyncio.create_task(services.metrics.refresh_now_and_then())
    if part.replaces:
        await getting_ready
    try:
        yield {KEY: services}
    finally:
        getting_ready.cancel()
        refreshing.cancel()
        services.close()


async def _get_ready(services: Services) -> None:
    """Open the store and warm the kernels while probes are answered already."""
    try:
        await services.probe.open()
    except StoreError as error:
        # readyz goes on trying; meanwhile it says what is wrong.
        where = services.settings.url.render_as_string(hide_password=True)
        logger.error("the store does not open: %s", error, extra={"store": where})
    threads, parser = services.parse_threads, services.parser
    if not is_compiled():
        logger.info("compiling, which takes half a minute; what comes of it is kept for the next start")
        with suppress(ParserEndedError):  # if that process ends early this one compiles what is missing
            await threads.run(partial(parser.call, compile_kernels))
        parser.close()
    await asyncio.gather(threads.run(warm_up), threads.run(parser.start))
    # What is there now stays: no need to look through it for garbage ever again.
    gc.collect()
    gc.freeze()
    services.readiness.warm = True
    services.metrics.refresh()
    logger.info("ready")
