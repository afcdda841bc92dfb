"""The contract as OpenAPI: what FastAPI derives, and errors and bodies that the routes declare by this."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic import BaseModel
from pydantic.json_schema import JsonSchemaMode, models_json_schema

from ..admission.entrance import GUARDED
from .answers import Problem
from .exchange import JSON
from .problems import MEDIA_TYPE

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
PROBLEM: dict[int | str, dict[str, Any]] = {
    "default": {
        "description": "A problem, named by its `code`; with 429 and 503, `Retry-After` has the seconds to wait",
        "content": {MEDIA_TYPE: {"schema": {"$ref": _REF.format(model="Problem")}}},
    }
}
"""The documentation of the errors of every route."""
# Models that no route declares: those of the problems, and of the bodies, which routes read by themselves.
_MODELS: list[tuple[type[BaseModel], JsonSchemaMode]] = [(Problem, "serialization")]


def takes(model: type[BaseModel], answer: type[BaseModel], examples: Mapping[str, Any], **more: Any) -> dict[str, Any]:
    """Return the arguments of the decorator of a route that reads its body itself: its documentation."""
    _MODELS.append((model, "validation"))
    content = {
        "schema": {"$ref": _REF.format(model=model.__name__)},
        "examples": {name: {"value": value} for name, value in examples.items()},
    }
    described = takes_content(JSON, content, "May be gzip (Content-Encoding). Metres and radians.")
    return {"response_model": answer, "openapi_extra": described | more}


def takes_content(media_type: str, content: dict[str, Any], description: str) -> dict[str, Any]:
    """Return the documentation of a body of a media type."""
    return {"requestBody": {"required": True, "description": description, "content": {media_type: content}}}


def describe(app: FastAPI, *, guarded: bool) -> dict[str, Any]:
    """Return the OpenAPI document of an application; `guarded`: its routes require keys."""
    document = get_openapi(title=app.title, version=app.version, description=DESCRIPTION, routes=app.routes)
    _, schemas = models_json_schema(_MODELS, ref_template=_REF)
    components = document["components"]
    components["schemas"] |= schemas["$defs"]
    components["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
    if guarded:
        for path, item in document["paths"].items():
            for operation in item.values() if path.startswith(GUARDED) else ():
                operation["security"] = [{"key": []}]
    return document
