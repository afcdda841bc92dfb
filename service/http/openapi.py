"""The contract as OpenAPI: what FastAPI derives, and the bodies that the routes read by themselves."""

from __future__ import annotations

from typing import Any

from fastapi import FastAPI
from fastapi.openapi.utils import get_openapi
from pydantic.json_schema import models_json_schema

from ..schemas import replies, requests

DESCRIPTION = """
Lays the line segments of a scan on those of a map and says where the scan was taken, how sure that is, and when it
cannot be told.

* Metres, radians, counter-clockwise. `pose` is the scan frame's pose in the map frame:
  `p_map = R(theta) p_scan + [x, y]`.
* A segment is `[x1, y1, x2, y2]`, directed: free space lies on its left.
* `null` means none. No number is ever NaN or infinite, and none may be sent.
* An honest "no answer" is 200 with a `status`; 4xx says that the request is wrong.
"""
_REF = "#/components/schemas/{model}"
_REQUESTS = (
    requests.RegisterRequest,
    requests.AssociateRequest,
    requests.BatchRequest,
    requests.VectorizeRequest,
    requests.MapDocument,
)


def describe(app: FastAPI) -> dict[str, Any]:
    """Return the OpenAPI document of an application."""
    document = get_openapi(
        title=app.title, version=app.version, description=DESCRIPTION, routes=app.routes, tags=app.openapi_tags
    )
    _, asked = models_json_schema([(model, "validation") for model in _REQUESTS], ref_template=_REF)
    _, failed = models_json_schema([(replies.Problem, "serialization")], ref_template=_REF)
    components = document.setdefault("components", {})
    schemas = components.setdefault("schemas", {})
    schemas |= asked["$defs"] | failed["$defs"]
    components["securitySchemes"] = {"key": {"type": "http", "scheme": "bearer"}}
    # A service without keys asks for none.
    document["security"] = [{"key": []}, {}]
    return document
