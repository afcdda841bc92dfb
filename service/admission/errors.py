"""Why a request is not let in, or has to go.

::

    AdmissionError
    ├── MissingKeyError      no key, and the service has keys
    ├── UnknownKeyError      a key that is none of the service's
    ├── NotReadyError        the service does not serve yet, or no longer
    ├── QueueFullError       every place is taken
    ├── ShareUsedError       every place is taken, and this key has its share of them
    ├── TooMuchHeldError     too many bytes of requests are in memory
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


class NotReadyError(AdmissionError):
    """The service does not serve yet, or no longer."""


class QueueFullError(AdmissionError):
    """Every place is taken."""

    def __init__(self) -> None:
        super().__init__("every core is searching and the queue is full")


class ShareUsedError(AdmissionError):
    """Every place is taken, and this key has its share of them."""

    def __init__(self) -> None:
        super().__init__("the queue is full, and this key has its share of it")


class TooMuchHeldError(AdmissionError):
    """Too many bytes of requests are in memory."""

    def __init__(self) -> None:
        super().__init__("too many large requests at once")


class DeadlinePassedError(AdmissionError):
    """The deadline passed before the search started."""

    def __init__(self) -> None:
        super().__init__("the deadline passed before the search started")
