"""Receiving a request's body: bounded in bytes and in time."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

from starlette.requests import Request

from ..parsing.reading import Body, too_large
from .problems import ProblemError


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
                        raise too_large(self._max_bytes)
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

    def _check_length(self, request: Request) -> None:
        length = request.headers.get("content-length")
        if length is not None and int(length) > self._max_bytes:
            raise too_large(self._max_bytes)


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


async def wait_for_hang_up(request: Request) -> None:
    """Return when the client is gone; the body has been read before."""
    while True:
        message = await request.receive()
        if message["type"] == "http.disconnect":
            return
