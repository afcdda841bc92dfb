"""What is wrong with a request as HTTP; `problems` has the status of each."""

from __future__ import annotations

from collections.abc import Iterable


class HttpError(Exception):
    """A request is wrong as HTTP; the message names the error."""

    message = ""

    def __init__(self, message: str = "") -> None:
        super().__init__(message or self.message)


class NotHttpError(HttpError):
    """Not HTTP at all."""

    message = "the request is not valid HTTP/1.1 (RFC 9112), or has an unknown method; send it with an HTTP client"


class ControlCharacterError(HttpError):
    """A control character in the path."""


class BodyBrokenError(HttpError):
    """The body ends before the length that its head announces, or its chunks are no chunks."""

    message = "the body ends early, or its chunks are malformed; send it as Content-Length or Transfer-Encoding state"


class NotFoundError(HttpError):
    """No such path."""

    message = "no resource has this path; see /openapi.json for the paths"


class MethodNotAllowedError(HttpError):
    """The path takes other methods, `allowed`."""

    def __init__(self, allowed: Iterable[str]) -> None:
        self.allowed = tuple(allowed)
        super().__init__(f"this path does not support the method; expected {', '.join(self.allowed)}")


class MediaTypeError(HttpError):
    """The body is not of the media type that is taken, by its head."""

    def __init__(self, taken: str) -> None:
        super().__init__(f"the media type of the body is not supported; send {taken} and state it as Content-Type")


class EncodingError(HttpError):
    """The body is packed in a way that is not taken."""

    message = "the content encoding is not supported; send the body as gzip, or without encoding"


class BodyTooSlowError(HttpError):
    """Head and body did not come in as many seconds as they may take together."""

    def __init__(self, seconds: float) -> None:
        super().__init__(f"the request did not arrive within {seconds:g} s; send it faster, or a smaller one")


class RefusedError(HttpError):
    """Anything else that the framework refuses."""

    message = "the request does not match the API; see /openapi.json for its form"
