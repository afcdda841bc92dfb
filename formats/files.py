"""Files of other people, read whole within a bound."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import orjson

from .errors import IncompleteFileError, MalformedFileError, TooLargeError
from .limits import MAX_JSON_VALUES
from .report import shown

BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # that some editors put in front of UTF-8
WIDE = (b"\xff\xfe", b"\xfe\xff")  # what UTF-16 begins with, as a redirection in PowerShell writes it


def name_of(path: Path) -> str:
    """Return what errors and reports call a file."""
    return shown(path.name)


def read_bounded(path: Path, limit: int) -> bytes:
    """Return what a file holds.

    Parameters
    ----------
    path : Path
    limit : int
        Bytes.

    Raises
    ------
    IncompleteFileError
        When there is no such file.
    MalformedFileError
        When it cannot be read.
    TooLargeError
        When it is longer than the limit.
    """
    try:
        with path.open("rb") as file:
            content = file.read(limit + 1)
    except FileNotFoundError as error:
        raise IncompleteFileError("there is no such file", argument=name_of(path)) from error
    except OSError as error:
        raise MalformedFileError(f"cannot be read: {error.strerror}", argument=name_of(path)) from error
    if len(content) > limit:
        raise TooLargeError(f"expected at most {limit} bytes", argument=name_of(path))
    return content


def text_of(content: bytes, name: str) -> str:
    """Decode UTF-8, with or without a byte-order mark.

    Raises
    ------
    MalformedFileError
        When it is something else.
    """
    if content.startswith(WIDE):
        raise MalformedFileError("is text in UTF-16; save it as UTF-8", argument=name)
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise MalformedFileError("expected text in UTF-8", argument=name) from error


def load_json(content: bytes, name: str) -> Any:
    """Parse JSON, with or without a byte-order mark.

    Raises
    ------
    MalformedFileError
        When it is none; orjson goes 1,024 levels deep at most.
    TooLargeError
        When it has so many values that they take much more memory than the file.
    """
    if sum(content.count(sign) for sign in (b",", b"[", b"{")) > MAX_JSON_VALUES:
        raise TooLargeError(f"expected at most {MAX_JSON_VALUES} values, lists and objects", argument=name)
    try:
        return orjson.loads(text_of(content, name))
    except orjson.JSONDecodeError as error:
        raise MalformedFileError("is not JSON", argument=name) from error
