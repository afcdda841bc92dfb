"""Why a request is not let in, or has to go.

::

    AdmissionError
    ├── MissingKeyError      no key, and the service has keys
    ├── UnknownKeyError      a key that is none of the service's
    ├── MissingRoleError     a key without the role that the request needs
    ├── ForeignMapError      a map that there is not for this key
    ├── ForeignHostError     under a host name that is not allowed
    ├── ForeignOriginError   sent by the page of another site
    ├── NotReadyError        the service does not serve yet, or no longer
    ├── QueueFullError       every place is taken
    ├── ShareUsedError       every place is taken, and this key has its share of them
    ├── TooMuchHeldError     too many bytes of requests or answers are in memory
    ├── ShareHeldError       this key has its share of these bytes
    └── DeadlinePassedError  the deadline passed before the search started
"""

from __future__ import annotations


class AdmissionError(Exception):
    """A request is not let in, or has to go; the message gives the reason."""


class MissingKeyError(AdmissionError):
    """No key, and the service has keys."""

    def __init__(self) -> None:
        super().__init__("the request has no key; send the header `Authorization: Bearer <key>`")


class UnknownKeyError(AdmissionError):
    """A key that is none of the service's."""

    def __init__(self) -> None:
        super().__init__("the service does not know this key; send a valid one")


class MissingRoleError(AdmissionError):
    """A key without the role that the request needs.

    Parameters
    ----------
    role : str, optional
        The role that it lacks; None for a path that is no route, for which it needs every role and all maps.
    """

    def __init__(self, role: str | None = None) -> None:
        lacking = "every role and all maps, which this path requires" if role is None else f"the role `{role}`"
        super().__init__(f"the key lacks {lacking}; send a key that has it")


class ForeignMapError(AdmissionError):
    """A map that does not exist for this key: the error hides whether one exists for others."""

    def __init__(self) -> None:
        super().__init__("no map is stored under this id; GET /v1/maps lists the ids")


class ForeignHostError(AdmissionError):
    """The request names a host that is not among the service's allowed names."""

    def __init__(self) -> None:
        super().__init__(
            "the host name of the request is not allowed; a service without keys expects an IP address or localhost. "
            "Set LINEFIX_HOSTS to allow further names"
        )


class ForeignOriginError(AdmissionError):
    """Sent by the page of another site."""

    def __init__(self) -> None:
        super().__init__(
            "a page of another site sent the request, which a service without keys rejects; send it from "
            "the service's own page, or set up keys"
        )


class NotReadyError(AdmissionError):
    """The service does not serve yet, or no longer."""


class QueueFullError(AdmissionError):
    """Every place is taken."""

    def __init__(self) -> None:
        super().__init__("all searches are running and the queue is full; send the request again later")


class ShareUsedError(AdmissionError):
    """Every place is taken, and this key, or address, has its share of them."""

    def __init__(self) -> None:
        super().__init__(
            "the queue is full, and this key or address has used its part of it; send the request again later"
        )


class TooMuchHeldError(AdmissionError):
    """Too many bytes of requests or answers are in memory."""

    def __init__(self) -> None:
        super().__init__(
            "large requests and answers use all memory that is reserved for them; send the request again later"
        )


class ShareHeldError(AdmissionError):
    """Of the bytes that are in memory this key, or address, has its share."""

    def __init__(self) -> None:
        super().__init__(
            "large requests and answers of this key or address use its part of the memory; send fewer at once"
        )


class DeadlinePassedError(AdmissionError):
    """The deadline passed before the search started."""

    def __init__(self) -> None:
        super().__init__(
            "the deadline passed before the search started; extend deadline_ms, or send the request again later"
        )
