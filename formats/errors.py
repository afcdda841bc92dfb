"""Errors of this package, each in one line that names the file.

::

    FormatError (InputError)
    ├── UnsupportedFormatError   no format that is read here, or one that needs another version
    ├── MalformedFileError       the file is not what its name or its beginning says
    ├── TooLargeError            more bytes, cells, entities, messages or levels than are read
    ├── IncompleteFileError      something is missing: the unit of a drawing, the picture of a grid, a topic
    ├── UprightFrameError        a scanner whose scan plane is not horizontal; `argument` is its frame
    └── InvalidOptionError       an option out of its range
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from registration import InputError


class FormatError(InputError):
    """Root of this package's errors; `argument` is the file's name, or the option's."""

    def __init__(self, message: str, *, argument: str = "", index: int | None = None) -> None:
        super().__init__(message, argument=argument, index=index)


class UnsupportedFormatError(FormatError):
    """The file has a format that is not read or written here."""


class MalformedFileError(FormatError):
    """The file cannot be read as what it claims to be."""


class TooLargeError(FormatError):
    """The file holds more than is read."""


class IncompleteFileError(FormatError):
    """The file leaves out something that only its owner knows."""


class UprightFrameError(FormatError):
    """The scan plane of a scanner is not horizontal: its ranges say nothing of where walls are."""


class InvalidOptionError(FormatError):
    """An option is out of its range."""


@contextmanager
def naming(name: str) -> Iterator[None]:
    """Name the file that is read in the errors that name neither a file nor an option."""
    try:
        yield
    except FormatError as error:
        if error.argument:
            raise
        raise type(error)(error.message, argument=name) from error.__cause__
