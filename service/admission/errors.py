"""Why a request is not let in, or has to go.

::

    AdmissionError
    ├── MissingKeyError      no key, and the service has keys
    ├── UnknownKeyError      a key that is none of the service's
    ├── MissingRoleError     a key that is not for this
    ├── ForeignMapError      a map that there is not for this key
    ├── ForeignHostError     under a name that nobody has said to be the service's
    ├── ForeignOriginError   sent by the page of another site
    ├── NotReadyError        the service does not serve yet, or no longer
    ├── QueueFullError       every place is taken
    ├── ShareUsedError       every place is taken, and this key has its share of them
    ├── TooManyConnectionsError  every connection that may be open is at work
    ├── TooMuchHeldError     too many bytes of requests or answers are in memory
    ├── ShareHeldError       this key has its share of these bytes
    └── DeadlinePassedError  the deadline passed before the search started
"""

from __future__ import annotations


class AdmissionError(Exception):
    """A request is not let in, or has to go; the message says why."""


class MissingKeyError(AdmissionError):
    """No key, and the service has keys."""

    def __init__(self) -> None:
        super().__init__("send Authorization: Bearer <key>")


class UnknownKeyError(AdmissionError):
    """A key that is none of the service's."""

    def __init__(self) -> None:
        super().__init__("this key is not known here")


class MissingRoleError(AdmissionError):
    """A key that is not for what is asked."""

    def __init__(self) -> None:
        super().__init__("this key is not for that")


class ForeignMapError(AdmissionError):
    """A map that there is not for this key: whether there is one for others is not told."""

    def __init__(self) -> None:
        super().__init__("no map is stored under this id")


class ForeignHostError(AdmissionError):
    """Asked for under a name that nobody has said to be the service's."""

    def __init__(self) -> None:
        super().__init__(
            "without keys the service answers to addresses and localhost only; LINEFIX_HOSTS names further hosts"
        )


class ForeignOriginError(AdmissionError):
    """Sent by the page of another site."""

    def __init__(self) -> None:
        super().__init__("without keys the service takes nothing that the page of another site sends")


class NotReadyError(AdmissionError):
    """The service does not serve yet, or no longer."""


class QueueFullError(AdmissionError):
    """Every place is taken."""

    def __init__(self) -> None:
        super().__init__("every core is searching and the queue is full")


class ShareUsedError(AdmissionError):
    """Every place is taken, and this key, or address, has its share of them."""

    def __init__(self) -> None:
        super().__init__("the queue is full, and this key, or address, has its share of it")


class TooManyConnectionsError(AdmissionError):
    """Every connection that may be open is at work."""

    def __init__(self) -> None:
        super().__init__("too many connections at once")


class TooMuchHeldError(AdmissionError):
    """Too many bytes of requests or answers are in memory."""

    def __init__(self) -> None:
        super().__init__("too many large requests or answers at once")


class ShareHeldError(AdmissionError):
    """Of the bytes that are in memory this key, or address, has its share."""

    def __init__(self) -> None:
        super().__init__("too many large requests or answers of this key, or address, at once")


class DeadlinePassedError(AdmissionError):
    """The deadline passed before the search started."""

    def __init__(self) -> None:
        super().__init__("the deadline passed before the search started")
