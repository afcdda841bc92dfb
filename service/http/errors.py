"""What is wrong with a request as HTTP.

::

    HttpError
    ├── NotHttpError           not HTTP at all
    ├── ControlCharacterError  a control character in the path
    ├── BodyBrokenError        the body ends early, or its chunks are no chunks
    ├── NotFoundError          no such path
    ├── MethodNotAllowedError  the path takes other methods
    ├── MediaTypeError         the body is not of the media type that is taken
    ├── EncodingError          the body is packed in a way that is not taken
    ├── BodyTooSlowError       the body did not come in time
    └── RefusedError           anything else that the framework refuses
"""

from __future__ import annotations

from collections.abc import Iterable


class HttpError(Exception):
    """A request is wrong as HTTP; the message names the error."""


class NotHttpError(HttpError):
    """Not HTTP at all."""

    def __init__(self) -> None:
        super().__init__(
            "the request is not valid HTTP/1.1 (RFC 9112), or has an unknown method; send it with an HTTP client"
        )


class ControlCharacterError(HttpError):
    """A control character in the path."""

    def __init__(self, character: str) -> None:
        super().__init__(f"the path has the control character U+{ord(character):04X}; expected none; remove it")


class BodyBrokenError(HttpError):
    """The body ends before the length that its head announces, or its chunks are no chunks."""

    def __init__(self) -> None:
        super().__init__(
            "the body ends early, or its chunks are malformed; send it as Content-Length or Transfer-Encoding state"
        )


class NotFoundError(HttpError):
    """No such path."""

    def __init__(self, message: str = "no resource has this path; see /openapi.json for the paths") -> None:
        super().__init__(message)


class MethodNotAllowedError(HttpError):
    """The path takes other methods.

    Parameters
    ----------
    allowed : iterable of str
        The methods that it takes.
    """

    def __init__(self, allowed: Iterable[str]) -> None:
        self.allowed = tuple(allowed)
        super().__init__(f"this path does not support the method; expected {', '.join(self.allowed)}")


class MediaTypeError(HttpError):
    """The body is not of the media type that is taken, by its head."""

    def __init__(self, taken: str) -> None:
        super().__init__(f"the media type of the body is not supported; send {taken} and state it as Content-Type")


class EncodingError(HttpError):
    """The body is packed in a way that is not taken."""

    def __init__(self) -> None:
        super().__init__("the content encoding is not supported; send the body as gzip, or without encoding")


class BodyTooSlowError(HttpError):
    """The body did not come in time.

    Parameters
    ----------
    seconds : float
        That head and body may take together.
    """

    def __init__(self, seconds: float) -> None:
        super().__init__(f"the request did not arrive within {seconds:g} s; send it faster, or a smaller one")


class RefusedError(HttpError):
    """Anything else that the framework refuses."""

    def __init__(self) -> None:
        super().__init__("the request does not match the API; see /openapi.json for its form")
