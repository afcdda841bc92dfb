"""Why bytes could not be read.

::

    ParsingError
    └── ParserEndedError  the process that parses large bodies has ended meanwhile
"""

from __future__ import annotations


class ParsingError(Exception):
    """Bytes could not be read; the message names the reason, and repeats none of them."""


class ParserEndedError(ParsingError):
    """The process that parses large bodies has ended meanwhile; the next call has a new one."""

    def __init__(self) -> None:
        super().__init__("the process that parses large bodies ended meanwhile; send the request again")
