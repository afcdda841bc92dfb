"""Declaration of routes: their errors, bodies and headers in OpenAPI, and routes without FastAPI's own reading."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from ..problems import KINDS, MEDIA_TYPE, Kind
from ..sending import JSON

EVERYWHERE = ("invalid_http", "unauthorized", "forbidden", "internal")
READS_BODY = ("invalid_json", "request_timeout", "too_large", "unsupported_media_type", "invalid_request")
SEARCHES = ("not_ready", "overloaded", "rate_limited", "deadline_exceeded")

REQUEST_ID: dict[str, Any] = {
    "X-Request-Id": {"description": "Taken over from the request or made", "schema": {"type": "string"}}
}
_RETRY: dict[str, Any] = {"Retry-After": {"description": "seconds", "schema": {"type": "string"}}}


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
                    "schema": {"$ref": "#/components/schemas/Problem"},
                    "examples": {kind.code: {"value": _example(kind)} for kind in kinds},
                }
            },
        }
        for status, kinds in by_status.items()
    }


def takes(model: type[BaseModel], examples: dict[str, Any]) -> dict[str, Any]:
    """Return the documentation of a body that the route itself reads."""
    return {
        "requestBody": {
            "required": True,
            "description": "May be gzip (Content-Encoding). Metres and radians.",
            "content": {
                JSON: {
                    "schema": {"$ref": f"#/components/schemas/{model.__name__}"},
                    "examples": {name: {"value": value} for name, value in examples.items()},
                }
            },
        }
    }


def _example(kind: Kind) -> dict[str, Any]:
    example: dict[str, Any] = {
        "type": f"urn:linefix:problem:{kind.code}",
        "title": kind.title,
        "status": kind.status,
        "detail": kind.title,
        "code": kind.code,
        "request_id": "0f1e2d3c4b5a69788796a5b4c3d2e1f0",
    }
    if kind.code == "invalid_request":
        example["detail"] = "/scan/segments/3: expected 4 numbers, found 3"
        example["errors"] = [{"pointer": "/scan/segments/3", "message": "expected 4 numbers, found 3"}]
    return example
