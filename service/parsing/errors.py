"""Why bytes could not be read.

::

    ParsingError
    ├── NotJsonError      the body is not JSON, or not packed as its head states
    └── ParserEndedError  the process that parses large bodies has ended meanwhile
"""

from __future__ import annotations


class ParsingError(Exception):
    """Bytes could not be read; the message names the reason, and repeats none of them."""


class NotJsonError(ParsingError):
    """The body is not JSON, or not packed as its head states."""


class ParserEndedError(ParsingError):
    """The process that parses large bodies has ended meanwhile; the next call has a new one."""

    def __init__(self) -> None:
        super().__init__("the process that parses large bodies ended meanwhile; send the request again")
