"""Errors that end a command before its result, each in one line that names the remedy.

::

    CommandError
    ├── WrongUseError   exit code 2: the command cannot be meant so
    ├── RefusedError    exit code 3: a file, or what is in it, is not taken
    │   └── NoSuchMapError   the name is neither that of a file nor of a stored map
    └── NoServerError   exit code 4: no server answers
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

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
    """

    def __init__(self, name: str) -> None:
        super().__init__(
            f"{name}: no such file, and no map is stored under this id; linefix map list shows the stored maps"
        )


class NoServerError(CommandError):
    """No server answers."""

    exit_code = 4


@dataclass(frozen=True, slots=True)
class Asked:
    """The subject of a request, as the user knows it.

    Attributes
    ----------
    map_id : str or None
        Of the stored map that it is about.
    files : tuple of str
        Names of the files that were sent.
    """

    map_id: str | None = None
    files: tuple[str, ...] = ()

    def place(self, pointer: str) -> str:
        """Return the user's name for a place in the request."""
        if not self.files:
            return pointer
        first, _, rest = pointer.removeprefix("/").partition("/")
        if first == "files":
            return self.files[int(rest)] if rest.isdecimal() and int(rest) < len(self.files) else self.files[0]
        option = "point" if first == "inside" else first.replace("_", "-")  # the name that `formats` has for it
        return f"--{option}" if first else self.files[0]


NOTHING = Asked()


def refused_at(faults: Sequence[tuple[str, str]], asked: Asked = NOTHING) -> RefusedError:
    """Return the error for places that are wrong, each a pointer and a message: the first are named, others counted."""
    named = [f"{place}: {message}" if (place := asked.place(pointer)) else message for pointer, message in faults]
    more = f" (and {len(named) - MOST_NAMED} more)" if len(named) > MOST_NAMED else ""
    return RefusedError("; ".join(named[:MOST_NAMED]) + more, faults[0][0])


@contextmanager
def refusing(asked: Asked = NOTHING) -> Iterator[None]:
    """Raise errors of the command line in place of those about a request."""
    from linefix.answering import NotStoredError
    from linefix.documents.errors import DeadlinePassedError, InvalidRequestError, TooManyError
    from linefix.documents.inputs import fault_of
    from registration import InputError

    try:
        yield
        return
    except DeadlinePassedError as error:
        raise NoServerError(str(error)) from None
    except NotStoredError as error:
        raise RefusedError(str(error)) from None
    except TooManyError as error:
        faults = [(error.pointer, str(error))]
    except InvalidRequestError as error:
        faults = [(one.pointer, one.message) for one in error.faults]
    except InputError as error:
        fault = fault_of(error)
        faults = [(fault.pointer, fault.message)]
    raise refused_at(faults, asked)
