"""Why a request is not served; `service.http.problems` has the status of each.

::

    ServiceError
    ├── of its head and body as HTTP, of its admission, of imports: each stands alone
    └── StoreError   the store of maps does not complete a request

What is wrong with the content of a request is an error of `linefix.documents`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

ENDING = "the service is shutting down; send the request to another instance, or again after its restart"


class ServiceError(Exception):
    """A request is not served; the message gives the caller the reason, as do headers of the answer."""

    message = ""
    headers: Mapping[str, str] = {}

    def __init__(self, message: str = "") -> None:
        super().__init__(message or self.message)


class NotHttpError(ServiceError):
    """Not HTTP at all."""

    message = "the request is not valid HTTP/1.1 (RFC 9112), or has an unknown method; send it with an HTTP client"


class BodyBrokenError(ServiceError):
    """The body ends before the length that its head announces, or its chunks are no chunks."""

    message = "the body ends early, or its chunks are malformed; send it as Content-Length or Transfer-Encoding state"


class NotFoundError(ServiceError):
    """No such path."""

    message = "no resource has this path; see /openapi.json for the paths"


class MethodNotAllowedError(ServiceError):
    """The path takes other methods."""

    def __init__(self, allowed: Iterable[str]) -> None:
        methods = ", ".join(allowed)
        super().__init__(f"this path does not support the method; expected {methods}")
        self.headers = {"Allow": methods}


class MediaTypeError(ServiceError):
    """The body is not of the media type that is taken, by its head."""

    def __init__(self, taken: str) -> None:
        super().__init__(f"the media type of the body is not supported; send {taken} and state it as Content-Type")


class EncodingError(ServiceError):
    """The body is packed in a way that is not taken."""

    message = "the content encoding is not supported; send the body as gzip, or without encoding"
    headers: Mapping[str, str] = {"Accept-Encoding": "gzip"}


class BodyTooSlowError(ServiceError):
    """Head and body did not come in as many seconds as they may take together."""

    def __init__(self, seconds: float) -> None:
        super().__init__(f"the request did not arrive within {seconds:g} s; send it faster, or a smaller one")


class ParserEndedError(ServiceError):
    """The process that parses large bodies has ended meanwhile, with this status; the next call has a new one."""

    message = "the process that parses large bodies ended meanwhile; send the request again"

    def __init__(self, status: int | None = None) -> None:
        super().__init__()
        self.status = status


class MissingKeyError(ServiceError):
    """No key, and the service has keys."""

    message = "the request has no key; send the header `Authorization: Bearer <key>`"
    headers: Mapping[str, str] = {"WWW-Authenticate": 'Bearer realm="linefix"'}


class UnknownKeyError(ServiceError):
    """A key that is none of the service's."""

    message = "the service does not know this key; send a valid one"


class MissingRoleError(ServiceError):
    """A key without the role that the request needs."""


class ForeignHostError(ServiceError):
    """The request names a host that is not among the service's allowed names."""

    message = (
        "the host name of the request is not allowed; a service without keys expects an IP address or localhost. "
        "Set LINEFIX_HOSTS to allow further names"
    )


class ForeignOriginError(ServiceError):
    """Sent by the page of another site."""

    message = (
        "a page of another site sent the request, which a service without keys rejects; send it from "
        "the service's own page, name that site in LINEFIX_CORS_ORIGINS, or set up keys"
    )


class NotReadyError(ServiceError):
    """The service does not serve yet, or no longer."""


class QueueFullError(ServiceError):
    """Every place is taken."""

    message = "all searches are running and the queue is full; send the request again later"


class ShareUsedError(ServiceError):
    """Every place is taken, and this key, or address, has its share of them."""

    message = "the queue is full, and this key or address has used its part of it; send the request again later"


class TooMuchHeldError(ServiceError):
    """Too many bytes of requests or answers are in memory."""

    message = "large requests and answers use all memory that is reserved for them; send the request again later"


class ShareHeldError(ServiceError):
    """Of the bytes that are in memory this key, or address, has its share."""

    message = "large requests and answers of this key or address use its part of the memory; send fewer at once"


class FormatsMissingError(ServiceError):
    """The extra ``[formats]`` is not installed."""

    message = (
        "the service cannot read files of other tools: it lacks the extra `formats`. Install it, for example with "
        '`pip install ".[formats]"` in a checkout'
    )


class UnknownFormatError(ServiceError):
    """None of the files has a format that is read."""


class FileTooLargeError(ServiceError):
    """A file holds more, or takes more to be read, than is allowed."""


class ImportTooLateError(ServiceError):
    """The deadline passed while files were read."""

    message = "the import took longer than its time; send a smaller file, or send the request again later"


class NoRoomError(ServiceError):
    """No room for the files, or for the process that reads them."""

    message = "the service has no disk space or process left to read files; send the request again later"


class StoreError(ServiceError):
    """The store of maps does not complete a request."""


class UnknownMapError(StoreError):
    """Nothing is stored under the id, or the key may not use it: the error hides whether there is a map for others."""

    message = "no map is stored under this id; GET /v1/maps lists the ids"


class CorruptMapError(StoreError):
    """The stored map is damaged."""

    message = "the stored map does not match its checksum; send it again with PUT"


class RevisionConflictError(StoreError):
    """The map is not as the writer demands; its present revision is None where there is no map."""

    def __init__(self, revision: int | None) -> None:
        now = "no map is stored under this id" if revision is None else f"the map's present revision is {revision}"
        super().__init__(f"{now}; If-Match or If-None-Match expects another state. Read the map again, then write")
        self.headers = {} if revision is None else {"ETag": f'"{revision}"'}


class StoreFullError(StoreError):
    """The disk is full, or the maps take all that they may."""

    message = "the disk that stores the maps is full; delete maps, or enlarge the disk"


class ReadOnlyStoreError(StoreError):
    """Nothing can be written."""

    message = "the store of maps is read-only; make its database writable"


class BusyStoreError(StoreError):
    """Others write for too long."""

    message = "the store is busy with other writes; send the request again"


class StoreAwayError(StoreError):
    """The database does not answer, or cannot be used."""

    message = "the database does not respond; check that it runs and is reachable"


class IndexNotReadyError(StoreError):
    """Another request indexes the map, and is not done in time."""

    message = "the map is being indexed for another request; send the request again"
