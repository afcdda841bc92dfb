"""The contract as OpenAPI: what FastAPI derives, and the bodies that the routes read by themselves."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic.json_schema import models_json_schema

from linefix.documents import analysis, parts, requests, updates
from linefix.documents.encoding import encode

from ..admission.entrance import GUARDED
from ..thread_pool import Threads
from .answers import Problem

DESCRIPTION = """
Finds the pose of a laser scan on a map of line segments. Each answer has a flag `usable`; where it is false, `reasons`
has the causes.

* Metres, radians, counter-clockwise. `pose` is the scan frame's pose in the map frame:
  `p_map = R(theta) p_scan + [x, y]`.
* A segment is `[x1, y1, x2, y2]`, directed: free space lies on its left.
* `null` means none. No number is ever NaN or infinite, and none may be sent.
* A scan without a usable pose is 200 with a `status`; 4xx states that the request is not valid.
"""
_REF = "#/components/schemas/{model}"
_REQUESTS = (
    requests.RegisterRequest,
    requests.AssociateRequest,
    requests.BatchRequest,
    requests.VectorizeRequest,
    requests.CheckRequest,
    analysis.AnalyzeRequest,
    analysis.MapAnalyzeRequest,
    updates.UpdateRequest,
    updates.ApplyRequest,
    parts.MapDocument,
)


def describe(app: FastAPI, *, guarded: bool) -> dict[str, Any]:
    """Return the OpenAPI document of an application; `guarded`: its routes require keys."""
    document = get_openapi(
        title=app.title, version=app.version, description=DESCRIPTION, routes=app.routes, tags=app.openapi_tags
    )
    _, asked = models_json_schema([(model, "validation") for model in _REQUESTS], ref_template=_REF)
    _, failed = models_json_schema([(Problem, "serialization")], ref_template=_REF)
    components = document.setdefault("components", {})
    schemas = components.setdefault("schemas", {})
    schemas |= asked["$defs"] | failed["$defs"]
    components["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
    if guarded:
        for path, item in document["paths"].items():
            for operation in item.values() if path.startswith(GUARDED) else ():
                operation["security"] = [{"key": []}]
    return document


class Contract:
    """The document as it is sent, one copy for all readers; belongs to one event loop.

    It takes some tenths of a second to make: in a thread, on the first request for it, and never again.

    Parameters
    ----------
    describe : callable
        Returns the document.
    threads : Threads
    """

    def __init__(self, describe: Callable[[], dict[str, Any]], threads: Threads) -> None:
        self._describe = describe
        self._threads = threads
        self._making: asyncio.Future[bytes] | None = None

    async def body(self) -> bytes:
        """Return it as JSON; requests that arrive while it is made wait for the same."""
        if self._making is None:
            self._making = asyncio.ensure_future(self._threads.run(lambda: encode(self._describe())))
        return await asyncio.shield(self._making)
