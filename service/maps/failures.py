"""What the failures of a database mean."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager

from sqlalchemy.exc import DBAPIError, OperationalError
from sqlalchemy.exc import TimeoutError as NoConnectionError

from ..http.problems import ProblemError

FULL = ("storage_full", "the disk that holds the maps is full")
READ_ONLY = ("read_only", "the maps cannot be written")
BUSY = ("overloaded", "the store is busy with other writes")
AWAY = ("not_ready", "the database does not answer")
DAMAGED = ("map_corrupt", "the database that holds the maps is damaged")

_SQLITE = {
    sqlite3.SQLITE_FULL: FULL,
    sqlite3.SQLITE_READONLY: READ_ONLY,
    sqlite3.SQLITE_CANTOPEN: READ_ONLY,
    sqlite3.SQLITE_IOERR: READ_ONLY,
    sqlite3.SQLITE_PERM: READ_ONLY,
    sqlite3.SQLITE_BUSY: BUSY,
    sqlite3.SQLITE_LOCKED: BUSY,
    sqlite3.SQLITE_CORRUPT: DAMAGED,
    sqlite3.SQLITE_NOTADB: DAMAGED,
}
# Beginnings of SQLSTATE codes, PostgreSQL's appendix A; the first that fits counts.
_POSTGRESQL = {
    "53100": FULL,
    "25006": READ_ONLY,
    "42501": READ_ONLY,  # the role may not
    "40": BUSY,  # deadlock, serialization
    "55P03": BUSY,
    "57014": BUSY,  # a statement or a lock took too long
    "53": AWAY,
    "57P": AWAY,
    "08": AWAY,
    "28": AWAY,
    "3D": AWAY,
    "42P01": DAMAGED,  # the table is gone
    "XX": DAMAGED,
}


@contextmanager
def failures_as_problems() -> Iterator[None]:
    """Turn what a database can refuse into problems; anything else is a defect and passes through."""
    try:
        yield
    except NoConnectionError as error:
        raise ProblemError(*BUSY) from error
    except UnicodeDecodeError as error:
        # The statements are right: a name that is no text is damage, which Python's driver cannot even tell.
        raise ProblemError(*DAMAGED) from error
    except DBAPIError as error:
        found = _of_sqlite(error.orig) if isinstance(error.orig, sqlite3.Error) else _of_postgresql(error)
        if found is None:
            raise
        raise ProblemError(*found) from error


def _of_sqlite(error: sqlite3.Error) -> tuple[str, str] | None:
    code = getattr(error, "sqlite_errorcode", None)
    if code is None or code == sqlite3.SQLITE_ERROR:
        # The statements are right: a name or a text that SQLite cannot read is damage.
        text = str(error)
        return DAMAGED if text.startswith(("no such ", "Could not decode", "malformed ")) else None
    return _SQLITE.get(code & 0xFF)


def _of_postgresql(error: DBAPIError) -> tuple[str, str] | None:
    state = getattr(error.orig, "sqlstate", None)
    if state is None:
        # Without a code it comes from the connection, not from the server.
        return AWAY if error.connection_invalidated or isinstance(error, OperationalError) else None
    return next((found for begin, found in _POSTGRESQL.items() if state.startswith(begin)), None)
