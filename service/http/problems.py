"""Errors over HTTP: RFC 9457 problems, and the one table that makes them of exceptions.

Nothing here repeats what a caller sent: messages are ours, pointers name places, and both are bounded.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import NoReturn

import orjson
from fastapi.exceptions import RequestValidationError
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response
from starlette.routing import Match

from association import CancelledError
from linefix.documents import errors as documents
from linefix.documents.errors import Fault, InvalidRequestError, TooManyError
from linefix.documents.inputs import faults_in
from linefix.documents.limits import MAX_FAULTS
from linefix.documents.reading import faults_of
from registration import InputError

from .. import errors

logger = logging.getLogger("linefix")
MEDIA_TYPE = "application/problem+json"
MAX_MESSAGE = 200
MAX_DETAIL = 400
MAX_POINTER = 120
NAMED_BY_CALLER = "/map_weights"  # an object whose fields are ids of maps


@dataclass(frozen=True, slots=True)
class Kind:
    """A row of the table: a stable code, on which programs branch, and the exceptions that become this problem."""

    code: str
    status: int
    title: str
    raised_as: tuple[type[Exception], ...] = ()


NOT_HTTP = (errors.NotHttpError, errors.BodyBrokenError)
STRANGE = (errors.UnknownKeyError, errors.ForeignHostError, errors.ForeignOriginError)
WRONG_KIND = (errors.MediaTypeError, errors.EncodingError, errors.FormatsMissingError, errors.UnknownFormatError)
BUSY = (errors.QueueFullError, errors.TooMuchHeldError, errors.BusyStoreError)
SHARES = (errors.ShareUsedError, errors.ShareHeldError)
LATE = (documents.DeadlinePassedError, errors.IndexNotReadyError, errors.ImportTooLateError)
TOO_LARGE = (TooManyError, documents.BodyTooLargeError, errors.FileTooLargeError)
TABLE = (
    Kind("invalid_json", 400, "The body is not JSON", (documents.NotJsonError,)),
    Kind("invalid_http", 400, "The request is not HTTP", NOT_HTTP),
    Kind("unauthorized", 401, "A key is required", (errors.MissingKeyError,)),
    Kind("forbidden", 403, "The request is not permitted", (*STRANGE, errors.MissingRoleError)),
    Kind("not_found", 404, "No resource has this path", (errors.NotFoundError,)),
    Kind("unknown_map", 404, "No map has this id", (errors.UnknownMapError,)),
    Kind("method_not_allowed", 405, "This path does not support the method", (errors.MethodNotAllowedError,)),
    Kind("request_timeout", 408, "The request did not arrive in time", (errors.BodyTooSlowError,)),
    Kind("map_corrupt", 409, "The stored map is damaged", (errors.CorruptMapError,)),
    Kind("revision_conflict", 412, "The precondition on the map's revision failed", (errors.RevisionConflictError,)),
    Kind("too_large", 413, "The request exceeds a limit", TOO_LARGE),
    Kind("unsupported_media_type", 415, "The media type is not supported", WRONG_KIND),
    Kind("invalid_request", 422, "The request is not valid", (InvalidRequestError, InputError)),
    Kind("rate_limited", 429, "This key exceeds its part of the queue", SHARES),
    Kind("internal", 500, "The service has a defect"),
    Kind("not_ready", 503, "The service is not ready", (errors.NotReadyError, errors.StoreAwayError, CancelledError)),
    Kind("overloaded", 503, "The service is busy", (*BUSY, errors.ParserEndedError, errors.NoRoomError)),
    Kind("read_only", 503, "The store cannot be written", (errors.ReadOnlyStoreError,)),
    Kind("deadline_exceeded", 504, "The deadline passed", LATE),
    Kind("storage_full", 507, "The store is full", (errors.StoreFullError,)),
)
KINDS: Mapping[str, Kind] = {kind.code: kind for kind in TABLE}
RAISED: Mapping[type[Exception], Kind] = {error: kind for kind in TABLE for error in kind.raised_as}
"""Every exception that becomes a problem; any other is a defect."""


@dataclass(frozen=True, slots=True)
class Problem:
    """An answer that is an error."""

    kind: Kind
    detail: str
    faults: Sequence[Fault] = ()
    headers: Mapping[str, str] = field(default_factory=dict)

    def as_json(self, request_id: str, move: Callable[[str], str] = str) -> dict[str, object]:
        """Return the problem document; `move` turns each pointer into the one to be sent."""
        faults = [Fault(_bounded(move(one.pointer)), one.message[:MAX_MESSAGE]) for one in self.faults[:MAX_FAULTS]]
        document: dict[str, object] = {
            "type": f"urn:linefix:problem:{self.kind.code}",
            "title": self.kind.title,
            "status": self.kind.status,
            "detail": documents.in_one_line(faults) if faults else self.detail[:MAX_DETAIL],
            "code": self.kind.code,
            "request_id": request_id,
        }
        if faults:
            document["errors"] = [{"pointer": one.pointer, "message": one.message} for one in faults]
        return document

    def response(self, request_id: str) -> Response:
        """Return it as a response."""
        headers = dict(self.headers)
        if self.kind.status in (429, 503):
            headers["Retry-After"] = "1"
        return Response(orjson.dumps(self.as_json(request_id)), self.kind.status, headers, MEDIA_TYPE)


INTERNAL = Problem(
    KINDS["internal"], "the service failed because of a defect; report it with the log entry that has this request id"
)
"""The answer to a defect, without any detail of it."""


def problem_of(error: Exception) -> Problem | None:
    """Return the problem that an exception stands for, or None for a defect."""
    kind = next((RAISED[base] for base in type(error).__mro__ if base in RAISED), None)
    if kind is None:
        return None
    faults: Sequence[Fault] = ()
    if isinstance(error, InvalidRequestError | InputError) or (isinstance(error, TooManyError) and error.pointer):
        faults = faults_in(error)
    detail = errors.ENDING if isinstance(error, CancelledError) else str(error)
    return Problem(kind, detail, faults, error.headers if isinstance(error, errors.ServiceError) else {})


def problem_or_defect(error: Exception, request_id: str) -> Problem:
    """Return the problem that an exception stands for; that of a defect is logged with the exception."""
    problem = problem_of(error)
    if problem is None:
        logger.error("a defect", exc_info=error, extra={"request_id": request_id})
    return problem or INTERNAL


async def raise_ours(request: Request, error: Exception) -> NoReturn:
    """Raise an exception of ours for what FastAPI and Starlette refuse by themselves."""
    if isinstance(error, RequestValidationError):
        raise InvalidRequestError(faults_of(error.errors()))
    if isinstance(error, HTTPException) and error.status_code == 405:  # the framework names the methods of one route
        matching = (route for route in request.app.routes if route.matches(request.scope)[0] is not Match.NONE)
        methods = {method for route in matching for method in getattr(route, "methods", ("GET",))}
        raise errors.MethodNotAllowedError(sorted(methods | {"HEAD"} if "GET" in methods else methods))
    raise errors.NotFoundError


def _bounded(pointer: str) -> str:
    return NAMED_BY_CALLER if pointer.startswith(NAMED_BY_CALLER + "/") else pointer[:MAX_POINTER]
