"""Why bytes could not be read.

::

    ParsingError
    └── ParserEndedError  the process that parses large bodies has ended meanwhile
"""

from __future__ import annotations


class ParsingError(Exception):
    """Bytes could not be read; the message names the reason, and repeats none of them."""


class ParserEndedError(ParsingError):
    """The process that parses large bodies has ended meanwhile, with this status; the next call has a new one."""

    def __init__(self, status: int | None = None) -> None:
        super().__init__(status)
        self.status = status

    def __str__(self) -> str:
        return "the process that parses large bodies ended meanwhile; send the request again"
