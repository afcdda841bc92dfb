"""The contract as OpenAPI: what FastAPI derives, and errors, bodies and headers that the routes declare by this."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel
from pydantic.json_schema import models_json_schema

from linefix.documents.errors import Fault

from ..admission.entrance import GUARDED
from . import answers
from .exchange import JSON
from .problems import KINDS, MEDIA_TYPE, Kind, Problem

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
EVERYWHERE = ("invalid_http", "unauthorized", "forbidden", "internal")
READS_BODY = ("invalid_json", "request_timeout", "too_large", "unsupported_media_type", "invalid_request")
SEARCHES = ("not_ready", "overloaded", "rate_limited", "deadline_exceeded")

REQUEST_ID: dict[str, Any] = {
    "X-Request-Id": {"description": "Taken over from the request or made", "schema": {"type": "string"}}
}
_RETRY: dict[str, Any] = {"Retry-After": {"description": "seconds", "schema": {"type": "string"}}}
_TAKEN: dict[str, type[BaseModel]] = {}  # models of the bodies that the routes read by themselves


def problems(*codes: str) -> dict[int | str, dict[str, Any]]:
    """Return the documentation of a route's errors."""
    by_status: dict[int | str, list[Kind]] = {}
    for code in codes:
        by_status.setdefault(KINDS[code].status, []).append(KINDS[code])
    return {
        status: {
            "description": "; ".join(f"`{kind.code}`: {kind.title}" for kind in kinds),
            "headers": REQUEST_ID | (_RETRY if status in (429, 503) else {}),
            "content": {
                MEDIA_TYPE: {
                    "schema": {"$ref": _REF.format(model="Problem")},
                    "examples": {kind.code: {"value": _example(kind)} for kind in kinds},
                }
            },
        }
        for status, kinds in by_status.items()
    }


def takes(model: type[BaseModel], examples: Mapping[str, Any]) -> dict[str, Any]:
    """Return the documentation of a body that the route itself reads."""
    _TAKEN[model.__name__] = model
    return {
        "requestBody": {
            "required": True,
            "description": "May be gzip (Content-Encoding). Metres and radians.",
            "content": {
                JSON: {
                    "schema": {"$ref": _REF.format(model=model.__name__)},
                    "examples": {name: {"value": value} for name, value in examples.items()},
                }
            },
        }
    }


def _example(kind: Kind) -> dict[str, object]:
    faults = [Fault("/scan/segments/3", "expected 4 numbers, found 3")] if kind.code == "invalid_request" else []
    return Problem(kind, kind.title, faults).as_json("0f1e2d3c4b5a69788796a5b4c3d2e1f0")


def describe(app: FastAPI, *, guarded: bool) -> dict[str, Any]:
    """Return the OpenAPI document of an application; `guarded`: its routes require keys."""
    document = get_openapi(
        title=app.title, version=app.version, description=DESCRIPTION, routes=app.routes, tags=app.openapi_tags
    )
    _, asked = models_json_schema([(model, "validation") for model in _TAKEN.values()], ref_template=_REF)
    _, failed = models_json_schema([(answers.Problem, "serialization")], ref_template=_REF)
    components = document.setdefault("components", {})
    schemas = components.setdefault("schemas", {})
    schemas |= asked["$defs"] | failed["$defs"]
    components["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
    if guarded:
        for path, item in document["paths"].items():
            for operation in item.values() if path.startswith(GUARDED) else ():
                operation["security"] = [{"key": []}]
    return document
