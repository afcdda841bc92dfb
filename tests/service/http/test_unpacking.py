"""Gzip within a limit."""

from __future__ import annotations

import gzip
import tracemalloc

import pytest

from linefix.documents.errors import BodyTooLargeError, NotJsonError
from service.http.bodies import unpack as unpack_counted

MEGABYTE = 1 << 20


def unpack(packed: bytes, max_bytes: int) -> bytearray:
    return unpack_counted(packed, max_bytes, lambda count: None)


@pytest.mark.parametrize("size", [2 * MEGABYTE, 64 * MEGABYTE])
def test_more_than_is_allowed_is_never_held(size: int) -> None:
    packed = gzip.compress(bytes(size), compresslevel=9)
    tracemalloc.start()
    try:
        with pytest.raises(BodyTooLargeError):
            unpack(packed, MEGABYTE)
        assert tracemalloc.get_traced_memory()[1] < 4 * MEGABYTE
    finally:
        tracemalloc.stop()


def test_a_body_in_many_pieces() -> None:
    import random

    data = random.Random(0).randbytes(3 * MEGABYTE)  # does not get smaller
    packed = gzip.compress(data, compresslevel=1)
    assert len(packed) > 3 * MEGABYTE
    assert unpack(packed, len(data)) == data
    with pytest.raises(BodyTooLargeError):
        unpack(packed, len(data) - 1)
    for end in (b"x", packed):
        with pytest.raises(NotJsonError, match="follow"):
            unpack(packed + end, 2 * len(data))
    with pytest.raises(NotJsonError, match="cut short"):
        unpack(packed[: 2 * MEGABYTE], len(data))


@pytest.mark.parametrize(
    ("packed", "message"),
    [
        (b"not gzip", "is not gzip"),
        (gzip.compress(b"{}", mtime=0)[:-4], "cut short"),
        (gzip.compress(b"{}", mtime=0) + b"more", "follow"),
        (gzip.compress(b"{}", mtime=0) * 2, "follow"),
        (b"", "cut short"),
    ],
)
def test_what_is_not_gzip(packed: bytes, message: str) -> None:
    with pytest.raises(NotJsonError, match=message):
        unpack(packed, 1000)
