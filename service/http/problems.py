"""Errors over HTTP: RFC 9457 problems.

Nothing here repeats what a caller sent: messages are ours, pointers name places, and both are bounded.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import Any

import orjson
from starlette.responses import Response

from ..schemas.parts import TAGS

MEDIA_TYPE = "application/problem+json"
MAX_ERRORS = 20
MAX_MESSAGE = 200
MAX_POINTER = 120
_PLAIN = re.compile(r"^[A-Za-z0-9_.-]{1,40}$")

CODES: dict[str, int] = {
    "invalid_json": 400,
    "invalid_http": 400,
    "unauthorized": 401,
    "forbidden": 403,
    "not_found": 404,
    "unknown_map": 404,
    "method_not_allowed": 405,
    "request_timeout": 408,
    "map_corrupt": 409,
    "revision_conflict": 412,
    "too_large": 413,
    "unsupported_media_type": 415,
    "invalid_request": 422,
    "rate_limited": 429,
    "internal": 500,
    "not_ready": 503,
    "overloaded": 503,
    "read_only": 503,
    "deadline_exceeded": 504,
    "storage_full": 507,
}
TITLES: dict[str, str] = {
    "invalid_json": "The body is not JSON",
    "invalid_http": "The request is not HTTP",
    "unauthorized": "A key is needed",
    "forbidden": "The key is not known",
    "not_found": "There is nothing here",
    "unknown_map": "There is no such map",
    "method_not_allowed": "The method is not allowed here",
    "request_timeout": "The body came too slowly",
    "map_corrupt": "The stored map is damaged",
    "revision_conflict": "The map is not as demanded",
    "too_large": "The request is over a limit",
    "unsupported_media_type": "The media type is not supported",
    "invalid_request": "The request is wrong",
    "rate_limited": "This key has used its share",
    "internal": "A defect of the service",
    "not_ready": "The service is not ready",
    "overloaded": "The service is busy",
    "read_only": "The store cannot be written",
    "deadline_exceeded": "The deadline passed before the search started",
    "storage_full": "The store is full",
}


@dataclass(frozen=True, slots=True)
class Fault:
    """One wrong place of a request."""

    pointer: str
    message: str

    def as_json(self) -> dict[str, str]:
        """Return it as it is sent, bounded."""
        return {"pointer": self.pointer[:MAX_POINTER], "message": self.message[:MAX_MESSAGE]}


@dataclass(slots=True, eq=False)
class ProblemError(Exception):
    """An answer that is an error: raised anywhere, sent by the application's handler."""

    code: str
    detail: str
    faults: Sequence[Fault] = ()
    headers: dict[str, str] = field(default_factory=dict)

    def __reduce__(self) -> tuple[Any, ...]:
        """Say how to pickle it: it crosses processes, and an exception's own way would lose the headers."""
        return ProblemError, (self.code, self.detail, self.faults, self.headers)

    @property
    def status(self) -> int:
        """The HTTP status of the code."""
        return CODES[self.code]

    def as_json(self, request_id: str, move: Callable[[str], str] = str) -> dict[str, object]:
        """Return the problem document; `move` turns each pointer into the one to be sent."""
        document: dict[str, object] = {
            "type": f"urn:linefix:problem:{self.code}",
            "title": TITLES[self.code],
            "status": self.status,
            "detail": self.detail[: 2 * MAX_MESSAGE],
            "code": self.code,
            "request_id": request_id,
        }
        if self.faults:
            document["errors"] = [
                Fault(move(fault.pointer), fault.message).as_json() for fault in self.faults[:MAX_ERRORS]
            ]
        return document

    def response(self, request_id: str) -> Response:
        """Return it as a response."""
        headers = dict(self.headers)
        if self.status in (HTTPStatus.SERVICE_UNAVAILABLE, HTTPStatus.TOO_MANY_REQUESTS):
            headers.setdefault("Retry-After", "1")
        return Response(orjson.dumps(self.as_json(request_id)), self.status, headers, MEDIA_TYPE)


def _pointer(parts: Sequence[object]) -> str:
    """Return a JSON pointer; a name that is not plain ends it, since it came from the caller."""
    pointer = ""
    for part in parts:
        if part in TAGS:
            continue
        name = str(part)
        if not _PLAIN.match(name):
            break
        pointer += f"/{name}"
    return pointer


# pydantic's own messages for these types repeat what was sent, or speak of Python.
_MESSAGES: dict[str, str] = {
    "extra_forbidden": "unknown field",
    "missing": "missing",
    "model_type": "expected an object",
    "model_attributes_type": "expected an object",
    "union_tag_invalid": "expected an object",
    "dict_type": "expected an object",
    "list_type": "expected an array",
    "float_type": "expected a number",
    "int_type": "expected an integer",
    "int_from_float": "expected an integer",
    "bool_type": "expected true or false",
    "string_type": "expected a string",
    "string_pattern_mismatch": "does not match the pattern",
}


def faults_of(items: Iterable[Mapping[str, Any]]) -> list[Fault]:
    """Return the first places that pydantic complained of."""
    faults: list[Fault] = []
    for item in items:
        place = _pointer(item["loc"])
        rows = item.get("ctx", {}).get("rows")
        if rows is None:
            faults.append(Fault(place, _MESSAGES.get(item["type"], item["msg"])))
        else:
            faults.extend(Fault(f"{place}/{index}", message) for index, message in rows)
        if len(faults) >= MAX_ERRORS:
            break
    return faults[:MAX_ERRORS]


def invalid(faults: Sequence[Fault]) -> ProblemError:
    """Return the problem of a request that is JSON but not what the route takes."""
    count = "one place is" if len(faults) == 1 else f"{len(faults)} places are"
    return ProblemError("invalid_request", f"{count} wrong; see errors", faults)


def internal() -> ProblemError:
    """Return what is said of a defect: nothing but that it is one."""
    return ProblemError("internal", "the service failed; the request id names the entry in its log")
