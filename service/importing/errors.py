"""Why a file of another tool is not read; what is wrong with one is an `InvalidRequestError`.

::

    ImportingError
    ├── FormatsMissingError    the extra [formats] is not installed
    ├── UnknownFormatError     none of the files has a format that is read
    ├── FileTooLargeError      a file holds more, or takes more to be read, than is allowed
    ├── TooLateError           the deadline passed meanwhile
    └── NoRoomError            no room for the files, or for the process that reads them
"""

from __future__ import annotations


class ImportingError(Exception):
    """A file of another tool is not read."""


class FormatsMissingError(ImportingError):
    """The extra ``[formats]`` is not installed."""

    def __init__(self) -> None:
        super().__init__(
            "the service cannot read files of other tools: it lacks the extra `formats`. Install it, for example with "
            '`pip install ".[formats]"` in a checkout'
        )


class UnknownFormatError(ImportingError):
    """None of the files has a format that is read."""


class FileTooLargeError(ImportingError):
    """A file holds more, or takes more to be read, than is allowed."""


class TooLateError(ImportingError):
    """The deadline passed meanwhile."""

    def __init__(self) -> None:
        super().__init__("the import took longer than its time; send a smaller file, or send the request again later")


class NoRoomError(ImportingError):
    """No room for the files, or for the process that reads them."""

    def __init__(self) -> None:
        super().__init__("the service has no disk space or process left to read files; send the request again later")
