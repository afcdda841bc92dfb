"""Why a request is not let in, or has to go; `service.http.problems` has the status of each."""

from __future__ import annotations


class AdmissionError(Exception):
    """A request is not let in, or has to go; the message gives the reason."""

    message = ""

    def __init__(self, message: str = "") -> None:
        super().__init__(message or self.message)


class MissingKeyError(AdmissionError):
    """No key, and the service has keys."""

    message = "the request has no key; send the header `Authorization: Bearer <key>`"


class UnknownKeyError(AdmissionError):
    """A key that is none of the service's."""

    message = "the service does not know this key; send a valid one"


class MissingRoleError(AdmissionError):
    """A key without the role that the request needs."""


class ForeignMapError(AdmissionError):
    """A map that does not exist for this key: the error hides whether one exists for others."""

    message = "no map is stored under this id; GET /v1/maps lists the ids"


class ForeignHostError(AdmissionError):
    """The request names a host that is not among the service's allowed names."""

    message = (
        "the host name of the request is not allowed; a service without keys expects an IP address or localhost. "
        "Set LINEFIX_HOSTS to allow further names"
    )


class ForeignOriginError(AdmissionError):
    """Sent by the page of another site."""

    message = (
        "a page of another site sent the request, which a service without keys rejects; send it from "
        "the service's own page, or set up keys"
    )


class NotReadyError(AdmissionError):
    """The service does not serve yet, or no longer."""


class QueueFullError(AdmissionError):
    """Every place is taken."""

    message = "all searches are running and the queue is full; send the request again later"


class ShareUsedError(AdmissionError):
    """Every place is taken, and this key, or address, has its share of them."""

    message = "the queue is full, and this key or address has used its part of it; send the request again later"


class TooMuchHeldError(AdmissionError):
    """Too many bytes of requests or answers are in memory."""

    message = "large requests and answers use all memory that is reserved for them; send the request again later"


class ShareHeldError(AdmissionError):
    """Of the bytes that are in memory this key, or address, has its share."""

    message = "large requests and answers of this key or address use its part of the memory; send fewer at once"


class DeadlinePassedError(AdmissionError):
    """The deadline passed before the search started."""

    message = "the deadline passed before the search started; extend deadline_ms, or send the request again later"
