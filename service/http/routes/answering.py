"""What the routes have in common: encoding, and how their operations are documented."""

from __future__ import annotations

from typing import Any

from fastapi import Request, Response
from pydantic import BaseModel

from ...schemas.encoding import encode
from ...work.stopwatch import Stopwatch
from ..problems import CODES, MEDIA_TYPE, TITLES
from ..reception import request_id_of

JSON = "application/json"


def sealed(answer: dict[str, Any], request: Request, watch: Stopwatch) -> bytes:
    """Return an answer as JSON with the request's id and its times."""
    answer["request_id"] = request_id_of(request.scope)
    answer["timing_ms"] = watch.timing_ms()
    return encode(answer)


def json_response(data: bytes, status: int = 200, headers: dict[str, str] | None = None) -> Response:
    """Return JSON that is encoded already."""
    return Response(data, status, headers, JSON)


def problems(*codes: str) -> dict[int | str, dict[str, Any]]:
    """Return the documentation of a route's errors."""
    by_status: dict[int | str, list[str]] = {}
    for code in codes:
        by_status.setdefault(CODES[code], []).append(code)
    return {
        status: {
            "description": "; ".join(f"`{code}`: {TITLES[code]}" for code in found),
            "headers": _HEADERS | (_RETRY if status in (429, 503) else {}),
            "content": {
                MEDIA_TYPE: {
                    "schema": {"$ref": "#/components/schemas/Problem"},
                    "examples": {code: {"value": _example(code)} for code in found},
                }
            },
        }
        for status, found in by_status.items()
    }


def takes(model: type[BaseModel], examples: dict[str, Any]) -> dict[str, Any]:
    """Return the documentation of a body that the route reads by itself."""
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


REQUEST_ID = {"X-Request-Id": {"description": "Taken over from the request or made", "schema": {"type": "string"}}}
_HEADERS: dict[str, Any] = {**REQUEST_ID}
_RETRY = {"Retry-After": {"description": "seconds", "schema": {"type": "string"}}}

EVERYWHERE = ("unauthorized", "forbidden", "internal")
READS_BODY = ("invalid_json", "request_timeout", "too_large", "unsupported_media_type", "invalid_request")
SEARCHES = ("not_ready", "overloaded", "rate_limited", "deadline_exceeded")


def _example(code: str) -> dict[str, Any]:
    example: dict[str, Any] = {
        "type": f"urn:linefix:problem:{code}",
        "title": TITLES[code],
        "status": CODES[code],
        "detail": TITLES[code],
        "code": code,
        "request_id": "0f1e2d3c4b5a69788796a5b4c3d2e1f0",
    }
    if code == "invalid_request":
        example["detail"] = "one place is wrong; see errors"
        example["errors"] = [{"pointer": "/scan/segments/3", "message": "expected 4 numbers, got 3"}]
    return example
