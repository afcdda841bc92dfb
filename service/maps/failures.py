"""Meanings of the failures of a database."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sqlalchemy.exc import DBAPIError, OperationalError
from sqlalchemy.exc import TimeoutError as NoConnectionError

from .errors import (
    BusyStoreError,
    CorruptMapError,
    ReadOnlyStoreError,
    StoreAwayError,
    StoreError,
    StoreFullError,
)

Failure = Callable[[], StoreError]


def damaged() -> CorruptMapError:
    """Return the error of a database whose own pages or tables are damaged."""
    return CorruptMapError("the database of the maps is damaged; restore it from a backup")


_SQLITE: dict[int, Failure] = {
    sqlite3.SQLITE_FULL: StoreFullError,
    sqlite3.SQLITE_READONLY: ReadOnlyStoreError,
    sqlite3.SQLITE_CANTOPEN: ReadOnlyStoreError,
    sqlite3.SQLITE_IOERR: ReadOnlyStoreError,
    sqlite3.SQLITE_PERM: ReadOnlyStoreError,
    sqlite3.SQLITE_BUSY: BusyStoreError,
    sqlite3.SQLITE_LOCKED: BusyStoreError,
    sqlite3.SQLITE_CORRUPT: damaged,
    sqlite3.SQLITE_NOTADB: damaged,
}
# Beginnings of SQLSTATE codes, PostgreSQL's appendix A; the first that fits counts.
_POSTGRESQL: dict[str, Failure] = {
    "53100": StoreFullError,
    "25006": ReadOnlyStoreError,
    "42501": ReadOnlyStoreError,  # the role may not
    "40": BusyStoreError,  # deadlock, serialization
    "55P03": BusyStoreError,
    "57014": BusyStoreError,  # a statement or a lock took too long
    "53": StoreAwayError,
    "57P": StoreAwayError,
    "08": StoreAwayError,
    "28": StoreAwayError,
    "3D": StoreAwayError,
    "42P01": damaged,  # the table is gone
    "XX": damaged,
}


@contextmanager
def failures_as_store_errors() -> Iterator[None]:
    """Turn a database's refusals into store errors; anything else is a defect and passes through."""
    try:
        yield
    except NoConnectionError as error:
        raise BusyStoreError from error
    except UnicodeDecodeError as error:
        # The statements are right: a name that is no text is damage, which Python's driver cannot even report.
        raise damaged() from error
    except DBAPIError as error:
        found = _of_sqlite(error.orig) if isinstance(error.orig, sqlite3.Error) else _of_postgresql(error)
        if found is None:
            raise
        raise found() from error


def _of_sqlite(error: sqlite3.Error) -> Failure | None:
    code = getattr(error, "sqlite_errorcode", None)
    if code is None or code == sqlite3.SQLITE_ERROR:
        # The statements are right: a name or a text that SQLite cannot read is damage.
        text = str(error)
        return damaged if text.startswith(("no such ", "Could not decode", "malformed ")) else None
    return _SQLITE.get(code & 0xFF)


def _of_postgresql(error: DBAPIError) -> Failure | None:
    state = getattr(error.orig, "sqlstate", None)
    if state is None:
        # Without a code it comes from the connection, not from the server.
        return StoreAwayError if error.connection_invalidated or isinstance(error, OperationalError) else None
    return next((found for begin, found in _POSTGRESQL.items() if state.startswith(begin)), None)
