"""Errors over HTTP: RFC 9457 problems, and the one table that makes them of exceptions.

Nothing here repeats what a caller sent: messages are ours, pointers name places, and both are bounded.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import orjson
from starlette.responses import Response

from association import CancelledError
from linefix.documents.errors import (
    BodyTooLargeError,
    Fault,
    InvalidRequestError,
    NotJsonError,
    TooManyError,
    in_one_line,
)
from linefix.documents.inputs import fault_of
from linefix.documents.limits import MAX_FAULTS
from linefix.documents.replies import ProblemCode
from registration import InputError

from ..admission import errors as admission
from ..importing import errors as importing
from ..maps import errors as maps
from ..parsing import errors as parsing
from . import errors as http
from .etags import etag

MEDIA_TYPE = "application/problem+json"
MAX_MESSAGE = 200
MAX_DETAIL = 400
MAX_POINTER = 120
CLOSE = {"Connection": "close"}
"""Of an answer that is given before the body was read: its rest is of no use."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A row of the table.

    Attributes
    ----------
    code : ProblemCode
        Stable; programs branch on it.
    status : int
    title : str
    raised_as : tuple of exception types
        The exceptions that become this problem.
    """

    code: ProblemCode
    status: int
    title: str
    raised_as: tuple[type[Exception], ...] = ()


TABLE = (
    Kind("invalid_json", 400, "The body is not JSON", (NotJsonError,)),
    Kind(
        "invalid_http",
        400,
        "The request is not HTTP",
        (http.NotHttpError, http.ControlCharacterError, http.BodyBrokenError),
    ),
    Kind("unauthorized", 401, "A key is required", (admission.MissingKeyError,)),
    Kind(
        "forbidden",
        403,
        "The request is not permitted",
        (
            admission.UnknownKeyError,
            admission.MissingRoleError,
            admission.ForeignHostError,
            admission.ForeignOriginError,
        ),
    ),
    Kind("not_found", 404, "No resource has this path", (http.NotFoundError,)),
    Kind("unknown_map", 404, "No map has this id", (maps.UnknownMapError, admission.ForeignMapError)),
    Kind("method_not_allowed", 405, "This path does not support the method", (http.MethodNotAllowedError,)),
    Kind("request_timeout", 408, "The request did not arrive in time", (http.BodyTooSlowError,)),
    Kind("map_corrupt", 409, "The stored map is damaged", (maps.CorruptMapError,)),
    Kind("revision_conflict", 412, "The precondition on the map's revision failed", (maps.RevisionConflictError,)),
    Kind(
        "too_large", 413, "The request exceeds a limit", (TooManyError, BodyTooLargeError, importing.FileTooLargeError)
    ),
    Kind(
        "unsupported_media_type",
        415,
        "The media type is not supported",
        (http.MediaTypeError, http.EncodingError, importing.FormatsMissingError, importing.UnknownFormatError),
    ),
    Kind("invalid_request", 422, "The request is not valid", (InvalidRequestError, InputError, http.RefusedError)),
    Kind(
        "rate_limited",
        429,
        "This key exceeds its part of the queue",
        (admission.ShareUsedError, admission.ShareHeldError),
    ),
    Kind("internal", 500, "The service has a defect"),
    Kind("not_ready", 503, "The service is not ready", (admission.NotReadyError, maps.StoreAwayError, CancelledError)),
    Kind(
        "overloaded",
        503,
        "The service is busy",
        (
            admission.QueueFullError,
            admission.TooMuchHeldError,
            maps.BusyStoreError,
            parsing.ParserEndedError,
            importing.NoRoomError,
        ),
    ),
    Kind("read_only", 503, "The store cannot be written", (maps.ReadOnlyStoreError,)),
    Kind(
        "deadline_exceeded",
        504,
        "The deadline passed before the search started",
        (admission.DeadlinePassedError, maps.IndexNotReadyError, importing.TooLateError),
    ),
    Kind("storage_full", 507, "The store is full", (maps.StoreFullError,)),
)
KINDS: Mapping[str, Kind] = MappingProxyType({kind.code: kind for kind in TABLE})
RAISED: Mapping[type[Exception], Kind] = MappingProxyType({error: kind for kind in TABLE for error in kind.raised_as})
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
        faults = [Fault(move(one.pointer)[:MAX_POINTER], one.message[:MAX_MESSAGE]) for one in self.faults[:MAX_FAULTS]]
        document: dict[str, object] = {
            "type": f"urn:linefix:problem:{self.kind.code}",
            "title": self.kind.title,
            "status": self.kind.status,
            "detail": in_one_line(faults) if faults else self.detail[:MAX_DETAIL],
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
    match error:
        case CancelledError():
            return Problem(
                kind, "the service is shutting down; send the request to another instance, or again after its restart"
            )
        case InputError():
            fault = fault_of(error)
            return Problem(kind, str(fault), (fault,))
        case InvalidRequestError():
            return Problem(kind, str(error), error.faults)
        case TooManyError(pointer=pointer) if pointer:
            return Problem(kind, str(error), (Fault(pointer, str(error)),))
    return Problem(kind, str(error), headers=headers_of(error))


def headers_of(error: Exception) -> Mapping[str, str]:
    """Return the headers that belong to an error."""
    match error:
        case admission.MissingKeyError():
            return {"WWW-Authenticate": 'Bearer realm="linefix"'}
        case BodyTooLargeError() | admission.TooMuchHeldError() | admission.ShareHeldError() | http.BodyTooSlowError():
            return CLOSE
        case maps.RevisionConflictError(revision=int(revision)):
            return {"ETag": etag(revision)}
        case http.MethodNotAllowedError(allowed=allowed):
            return {"Allow": ", ".join(allowed)}
        case http.EncodingError():
            return {"Accept-Encoding": "gzip"}
    return {}
