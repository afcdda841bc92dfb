"""Why a command ends without doing what was asked, each in one line that says what to do.

::

    CommandError
    ├── WrongUseError   exit code 2: the command cannot be meant so
    ├── RefusedError    exit code 3: a file, or what is in it, is not taken
    └── NoServerError   exit code 4: nobody there who would answer
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

BUSY = (401, 403, 408, 429)  # of 4xx those that are no word about what was sent


class CommandError(Exception):
    """A command ends; the message is all that is shown."""

    exit_code = 1


class WrongUseError(CommandError):
    """The command cannot be meant so."""

    exit_code = 2


class RefusedError(CommandError):
    """A file, or what is in it, is not taken."""

    exit_code = 3


class NoServerError(CommandError):
    """Nobody is there who would answer."""

    exit_code = 4


def error_of(status: int, detail: str, faults: Sequence[Mapping[str, Any]]) -> CommandError:
    """Return the error that a problem of the service stands for.

    Parameters
    ----------
    status : int
        As over HTTP.
    detail : str
    faults : sequence of mapping
        ``pointer`` and ``message`` of each place that is wrong; the first is shown, the others are counted.
    """
    message = detail
    if faults:
        message = f"{faults[0]['pointer']}: {faults[0]['message']}"
        if len(faults) > 1:
            message += f" (and {len(faults) - 1} more)"
    if 400 <= status < 500 and status not in BUSY:
        return RefusedError(message)
    return NoServerError(message)
