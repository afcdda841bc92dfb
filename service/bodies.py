"""Reading a request's body: bounded in bytes and in time, gzip unpacked under the same bound."""

from __future__ import annotations

import asyncio
import zlib
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import orjson
from pydantic import BaseModel, ValidationError
from starlette.requests import Request

from .problems import ProblemError, faults_of, invalid

M = TypeVar("M", bound=BaseModel)
_PIECE = 1 << 20


@dataclass(frozen=True, slots=True)
class Body:
    """A body as it arrived."""

    data: bytearray
    gzipped: bool


class BodyReader:
    """Reads bodies, and knows how many bytes of them are being read.

    Parameters
    ----------
    max_bytes : int
        Of one body, as it arrives and unpacked.
    max_bytes_at_once : int
        Of all bodies that are being read or parsed.
    timeout : float
        Seconds that a request may take to arrive, its head included.
    """

    def __init__(self, max_bytes: int, max_bytes_at_once: int, timeout: float) -> None:
        self._max_bytes = max_bytes
        self._max_at_once = max_bytes_at_once
        self._timeout = timeout
        self.held = 0

    @asynccontextmanager
    async def reading(self, request: Request) -> AsyncIterator[Body]:
        """Read a body whole; its bytes count as held until the block ends.

        Raises
        ------
        ProblemError
            When it is no JSON by its headers, larger than allowed, too slow, or too much is in memory already.
        """
        gzipped = _check_headers(request)
        self._check_length(request)
        data = bytearray()
        now = asyncio.get_running_loop().time()
        try:
            async with asyncio.timeout_at(request.scope["state"].get("arrived", now) + self._timeout):
                async for piece in request.stream():
                    if len(data) + len(piece) > self._max_bytes:
                        raise self._too_large()
                    if self.held + len(piece) > self._max_at_once:
                        raise ProblemError(
                            "overloaded", "too many large requests at once", headers={"Connection": "close"}
                        )
                    data += piece
                    self.held += len(piece)
            yield Body(data, gzipped)
        except TimeoutError:
            raise ProblemError(
                "request_timeout",
                f"the request did not arrive within {self._timeout:g} seconds",
                headers={"Connection": "close"},
            ) from None
        finally:
            self.held -= len(data)

    def unpack(self, body: Body) -> bytes | bytearray:
        """Return the body's bytes, at most as many as are allowed; runs off the event loop.

        Raises
        ------
        ProblemError
            When it is not gzip though it says so, or unpacks to more than is allowed.
        """
        if not body.gzipped:
            return body.data
        unpacked = bytearray()
        stream = zlib.decompressobj(wbits=zlib.MAX_WBITS | 16)
        packed = memoryview(body.data)
        try:
            for begin in range(0, len(packed), _PIECE):
                rest: bytes | memoryview = packed[begin : begin + _PIECE]
                while rest and not stream.eof:
                    unpacked += stream.decompress(rest, self._max_bytes + 1 - len(unpacked))
                    rest = stream.unconsumed_tail
                    if len(unpacked) > self._max_bytes:
                        raise self._too_large()
                if stream.eof and (stream.unused_data or begin + _PIECE < len(packed)):
                    raise ProblemError("invalid_json", "something follows the gzip body")
            unpacked += stream.flush()
        except zlib.error:
            raise ProblemError("invalid_json", "the body is not gzip, though Content-Encoding says so") from None
        if not stream.eof:
            raise ProblemError("invalid_json", "the gzip body is cut short")
        return unpacked

    def _check_length(self, request: Request) -> None:
        length = request.headers.get("content-length")
        if length is not None and int(length) > self._max_bytes:
            raise self._too_large()

    def _too_large(self) -> ProblemError:
        # The rest of the body is of no use: the connection ends with the answer.
        return ProblemError(
            "too_large", f"a body has at most {self._max_bytes} bytes, unpacked", headers={"Connection": "close"}
        )


def _check_headers(request: Request) -> bool:
    """Refuse what is not JSON by its headers; tell whether it is gzip."""
    media_type = request.headers.get("content-type", "application/json").split(";")[0].strip().lower()
    if media_type != "application/json" and not (
        media_type.startswith("application/") and media_type.endswith("+json")
    ):
        raise ProblemError("unsupported_media_type", "the body has to be application/json")
    encodings = [part.strip().lower() for part in request.headers.get("content-encoding", "").split(",")]
    encodings = [part for part in encodings if part not in ("", "identity")]
    if encodings not in ([], ["gzip"], ["x-gzip"]):
        raise ProblemError(
            "unsupported_media_type", "the only content encoding taken is gzip", headers={"Accept-Encoding": "gzip"}
        )
    return bool(encodings)


def parse(data: bytes | bytearray) -> Any:
    """Parse JSON; NaN, infinities, lone surrogates and nesting beyond 1,024 levels are not JSON here.

    Raises
    ------
    ProblemError
        When it is not JSON.
    """
    try:
        return orjson.loads(data)
    except orjson.JSONDecodeError as error:
        # The message of the parser speaks of the kind of error and its place, not of the text.
        raise ProblemError("invalid_json", f"{error.msg} at line {error.lineno} column {error.colno}") from None


def validate(model: type[M], value: Any, limits: dict[str, int]) -> M:
    """Check parsed JSON against a request model.

    Raises
    ------
    ProblemError
        When it is not what the model takes.
    TooLargeError
        When an array is longer than `limits` allow.
    """
    try:
        return model.model_validate(value, context=limits)
    except ValidationError as error:
        raise invalid(faults_of(error.errors(include_url=False, include_input=False))) from None


async def wait_for_hang_up(request: Request) -> None:
    """Return when the client is gone; the body has been read before."""
    while True:
        message = await request.receive()
        if message["type"] == "http.disconnect":
            return
