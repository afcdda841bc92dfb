"""Errors that end a command before its result, each in one line that names the remedy.

::

    CommandError
    ├── WrongUseError   exit code 2: the command cannot be meant so
    ├── RefusedError    exit code 3: a file, or what is in it, is not taken
    │   └── NoSuchMapError   the name is neither that of a file nor of a stored map
    └── NoServerError   exit code 4: no server answers
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from typing import Any

from linefix.documents.errors import Fault

MOST_NAMED = 4  # wrong places in one line


class CommandError(Exception):
    """A command ends; the message is all that is shown."""

    exit_code = 1


class WrongUseError(CommandError):
    """The command cannot be meant so."""

    exit_code = 2


class RefusedError(CommandError):
    """A file, or what is in it, is not taken.

    Parameters
    ----------
    message : str
    pointer : str
        The place in the request that is wrong; empty: none in particular.
    """

    exit_code = 3

    def __init__(self, message: str, pointer: str = "") -> None:
        super().__init__(message)
        self.pointer = pointer


class NoSuchMapError(RefusedError):
    """The name is neither that of a file nor of a stored map.

    Parameters
    ----------
    name : str
        As it was given.
    more : str
        Options of the command that lists the maps, such as ``--server URL``.
    """

    def __init__(self, name: str, more: str = "") -> None:
        command = f"linefix map list {more}".rstrip()
        super().__init__(f"{name}: no such file, and no map is stored under this id; {command} shows the stored maps")


class NoServerError(CommandError):
    """No server answers."""

    exit_code = 4


Names = Mapping[str, str]
"""Names that the user has for places in a request: of a file or an option, by the beginning of a JSON pointer."""

NO_NAMES: Names = {}


def flags_of(group: Any, place: str = "") -> dict[str, str]:
    """Return the names of options that belong together, by the places of their values in a request."""
    return {f"{place}/{one.name}": f"--{one.name.replace('_', '-')}" for one in fields(group)}


def place_of(pointer: str, names: Names) -> str:
    """Return the user's name for a place in a request, and the rest of the pointer."""
    begin = max((one for one in names if f"{pointer}/".startswith(f"{one}/")), key=len, default=None)
    if begin is None:
        return pointer
    name, rest = names[begin], pointer[len(begin) :]
    if name.startswith("--"):
        return " ".join([name, *rest.split("/")[1:]])
    return f"{name}: {rest}" if rest else name


def refused_at(faults: Sequence[Fault], names: Names) -> RefusedError:
    """Return the error for places that are wrong: the first are named, others counted."""
    told = [str(Fault(place_of(one.pointer, names), one.message)) for one in faults]
    more = f" (and {len(told) - MOST_NAMED} more)" if len(told) > MOST_NAMED else ""
    return RefusedError("; ".join(told[:MOST_NAMED]) + more, faults[0].pointer)


@contextmanager
def needing(what: str, *extras: str) -> Iterator[None]:
    """Raise `RefusedError` if an extra is missing, by default ``[formats]``, or a library refuses a file or an option.

    Raises
    ------
    RefusedError
    """
    from registration import InputError

    try:
        yield
    except ModuleNotFoundError as error:
        extras = extras or ("formats",)
        needed = f"package {error.name}, of the extra{'s' * (len(extras) > 1)} {' and '.join(extras)}"
        raise RefusedError(f'{what} needs the {needed}: in a checkout, pip install ".[{",".join(extras)}]"') from None
    except InputError as error:
        raise RefusedError(f"--point: {error.message}" if error.argument == "point" else str(error)) from None


@contextmanager
def refusing(names: Names = NO_NAMES) -> Iterator[None]:
    """Raise errors of the command line in place of those about a request."""
    from linefix.documents.errors import DeadlinePassedError, RequestError
    from linefix.documents.inputs import faults_in
    from registration import InputError

    try:
        yield
    except DeadlinePassedError as error:
        raise NoServerError(str(error)) from None
    except (RequestError, InputError) as error:
        raise refused_at(faults_in(error), names) from None
