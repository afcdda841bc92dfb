"""Unpacking a body that came as gzip, within a limit."""

from __future__ import annotations

import zlib
from collections.abc import Callable

from linefix.documents.errors import BodyTooLargeError, NotJsonError

_PIECE = 1 << 20  # bytes that are unpacked at a time
_GZIP = zlib.MAX_WBITS | 16


def unpack(packed: bytes | bytearray, max_bytes: int, take: Callable[[int], None]) -> bytearray:
    """Return what one gzip member holds; takes a while for a large one.

    Parameters
    ----------
    packed : bytes or bytearray
    max_bytes : int
        That it may unpack to; more is never held.
    take : callable
        Called with the number of further bytes, piece by piece; an exception from it ends this.

    Raises
    ------
    NotJsonError
        When it is not gzip, is cut short, or something follows it.
    BodyTooLargeError
        When it unpacks to more than is allowed.
    """
    unpacked = bytearray()
    stream = zlib.decompressobj(wbits=_GZIP)
    whole = memoryview(packed)
    try:
        for begin in range(0, len(whole), _PIECE):
            rest: bytes | memoryview = whole[begin : begin + _PIECE]
            while rest and not stream.eof:
                piece = stream.decompress(rest, min(_PIECE, max_bytes + 1 - len(unpacked)))
                take(len(piece))
                unpacked += piece
                rest = stream.unconsumed_tail
                if len(unpacked) > max_bytes:
                    raise BodyTooLargeError(max_bytes)
            if stream.eof and (stream.unused_data or begin + _PIECE < len(whole)):
                raise NotJsonError("more bytes follow the gzip body; expected a single gzip member")
        unpacked += stream.flush()
    except zlib.error:
        raise NotJsonError(
            "the body is not gzip, but Content-Encoding states it; send gzip, or omit the header"
        ) from None
    if not stream.eof:
        raise NotJsonError("the gzip body is cut short; send it completely")
    return unpacked
