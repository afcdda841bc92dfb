"""Why a request is not what the contract takes.

::

    RequestError
    ├── NotJsonError          bytes are not JSON, or not packed as stated
    ├── InvalidRequestError   places that are wrong
    ├── TooManyError          more of something than a limit allows
    └── BodyTooLargeError     more bytes than a limit allows

They cross processes: what they are made of is in their `args`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from registration import InputError


@dataclass(frozen=True, slots=True)
class Fault:
    """One wrong place of a request: a JSON pointer, and what is wrong there."""

    pointer: str
    message: str

    def __str__(self) -> str:
        """Return both in one line."""
        return f"{self.pointer}: {self.message}" if self.pointer else self.message


def fault_of(error: InputError) -> Fault:
    """Return the place of a request that a library refuses; its arguments are named as fields, with dots."""
    index = "" if error.index is None else f"/{error.index}"
    return Fault("/" + error.argument.replace(".", "/") + index, error.message)


def in_one_line(faults: Sequence[Fault]) -> str:
    """Return the first of some faults, at least one, and how many more there are."""
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    return f"{faults[0]}{more}"


class RequestError(Exception):
    """A request is not what the contract takes."""


class NotJsonError(RequestError):
    """Bytes are not JSON, or not packed as stated."""


class InvalidRequestError(RequestError):
    """Places of a request are wrong.

    Parameters
    ----------
    faults : sequence of Fault
        At least one.
    """

    def __init__(self, faults: Sequence[Fault]) -> None:
        super().__init__(tuple(faults))
        self.faults = tuple(faults)

    def __str__(self) -> str:
        """Name the first place."""
        return in_one_line(self.faults)


class TooManyError(RequestError):
    """A part of a request is over one of the limits of ``/v1/limits``.

    Parameters
    ----------
    pointer : str
        To the part, empty for the whole.
    limit : int
    what : str
        That there are too many of.
    """

    def __init__(self, pointer: str, limit: int, what: str) -> None:
        super().__init__(pointer, limit, what)
        self.pointer = pointer
        self.limit = limit
        self.what = what

    def __str__(self) -> str:
        """Name the limit."""
        return f"expected at most {self.limit} {self.what}, found more; see /v1/limits"


class BodyTooLargeError(RequestError):
    """A body is too long, as it arrives or unpacked; its rest is of no use."""

    def __init__(self, max_bytes: int) -> None:
        super().__init__(max_bytes)
        self.max_bytes = max_bytes

    def __str__(self) -> str:
        """Name the limit."""
        return f"expected a body of at most {self.max_bytes} bytes, unpacked; found more"


class DeadlinePassedError(Exception):
    """The deadline passed before the search started."""

    def __str__(self) -> str:
        """Name the remedy."""
        return "the deadline passed before the search started; extend deadline_ms, or send the request again later"
