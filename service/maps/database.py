"""Connections to the database behind the map store, set so that committed data stays committed; their failures."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Engine, create_engine, event
from sqlalchemy.engine import Connection
from sqlalchemy.exc import DBAPIError, OperationalError
from sqlalchemy.exc import TimeoutError as NoConnectionError

from ..database_location import file_of, make_file
from ..errors import BusyStoreError, CorruptMapError, ReadOnlyStoreError, StoreAwayError, StoreError, StoreFullError

BUSY_SECONDS = 5.0
RESERVE = 1 << 17  # bytes of a file next to the database's: on a full disk, the journal of a deletion takes its room


def open_engine(url: URL, *, at_once: bool = False) -> Engine:
    """Return an engine; nothing is opened yet.

    A file of SQLite's is opened where there is one, and never made: see `DatabaseFile`.

    Parameters
    ----------
    url : URL
    at_once : bool
        True for short reads outside of transactions, which wait for no writer and for no second round trip.
    """
    if url.get_backend_name() == "sqlite":
        # No bound on connections: each is used by one thread, whose number is bounded elsewhere. A statement that is
        # kept keeps its last arguments: 15 MB on each connection where these are documents.
        waits = {"timeout": 0.0 if at_once else BUSY_SECONDS, "cached_statements": 16 if at_once else 0}
        path = file_of(url)
        if path is not None:
            url = url.set(database=path.as_uri()).update_query_dict({"mode": "rw", "uri": "true"})
        if at_once:  # nothing to begin or to reset: half of the time of a read
            engine = create_engine(url, connect_args=waits, max_overflow=-1, pool_reset_on_return=None)
            event.listen(engine, "connect", _prepare_reader)
            return engine
        engine = create_engine(url, connect_args=waits, max_overflow=-1)
        event.listen(engine, "connect", _prepare_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
        return engine
    # A server that vanished from the network must not hold a thread for ever.
    waits = {"connect_timeout": 3, "tcp_user_timeout": 10_000}
    unsaid = {name: value for name, value in waits.items() if name not in url.query}
    kind: dict[str, Any] = {"isolation_level": "AUTOCOMMIT"} if at_once else {"pool_pre_ping": True}
    engine = create_engine(url, connect_args=unsaid, pool_timeout=BUSY_SECONDS, max_overflow=20, **kind)
    event.listen(engine, "connect", _prepare_postgresql)
    return engine


class DatabaseFile:
    """The file of a database: made once, for its owner alone, and missed when it is gone.

    Parameters
    ----------
    path : Path
    may_make : bool
        True when the file is made if it is missing: not for a process that replaces an earlier one.
    """

    def __init__(self, path: Path, *, may_make: bool) -> None:
        self._path = path
        self._reserve = path.with_name(path.name + "-reserve")
        self._may_make = may_make
        self._known: tuple[int, int] | None = None

    def require(self) -> None:
        """Make the file where there never was one, and its directory.

        Raises
        ------
        ReadOnlyStoreError
            When it cannot be made.
        StoreAwayError
            When it was there, and is no longer: a new one in its place would hide that.
        """
        if self._may_make and not self._path.exists():
            try:
                make_file(self._path)
            except OSError as error:
                raise ReadOnlyStoreError(
                    "the database file of the maps, or its folder, cannot be created; check the permissions"
                ) from error
        self._may_make = False
        self._known = self._found()
        if self._known is None:
            raise StoreAwayError(
                "the database file of the maps is missing; restore it, or restart the service for an empty one"
            )
        self._make_reserve()

    @contextmanager
    def lending_reserve(self) -> Iterator[None]:
        """Give the room of the reserve to what is written meanwhile."""
        with suppress(OSError):
            self._reserve.unlink()
        try:
            yield
        finally:
            self._make_reserve()

    @property
    def is_the_same(self) -> bool:
        """Return whether the file is the one that was found last."""
        found = self._found()
        return found is not None and found == self._known

    def _make_reserve(self) -> None:
        with suppress(OSError):  # the disk is full, or can only be read
            if not self._reserve.exists():
                make_file(self._reserve)
                self._reserve.write_bytes(bytes(RESERVE))

    def _found(self) -> tuple[int, int] | None:
        try:
            found = os.stat(self._path)
        except OSError:
            return None
        return found.st_dev, found.st_ino


def _prepare_reader(connection: Any, _: Any) -> None:
    connection.isolation_level = None  # transactions begin in _begin_sqlite, not where the driver guesses
    connection.execute("PRAGMA cell_size_check=ON")


def _prepare_sqlite(connection: Any, _: Any) -> None:
    _prepare_reader(connection, _)
    try:
        # A commit is one only when the journal is gone, after a power cut too: EXTRA syncs the directory.
        for pragma in ("journal_mode=DELETE", "synchronous=EXTRA"):
            connection.execute(f"PRAGMA {pragma}").fetchall()
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode & 0xFF not in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN):
            raise


def _begin_sqlite(connection: Connection) -> None:
    # A read is one statement, which needs no transaction of its own.
    if connection.get_execution_options().get("writes", False):
        connection.exec_driver_sql("BEGIN IMMEDIATE")


def _prepare_postgresql(connection: Any, _: Any) -> None:
    """Have commits wait for the disk where the server's settings would not; leave stricter settings as they are."""
    with connection.cursor() as cursor:
        cursor.execute(
            "SELECT set_config('synchronous_commit', 'on', false) WHERE current_setting('synchronous_commit') = 'off'"
        )
        cursor.execute(
            "SELECT set_config('lock_timeout', %s, false) WHERE current_setting('lock_timeout') = '0'",
            (f"{BUSY_SECONDS:g}s",),
        )
    connection.commit()


def damaged() -> CorruptMapError:
    """Return the error of a database whose own pages or tables are damaged."""
    return CorruptMapError("the database of the maps is damaged; restore it from a backup")


_SQLITE: dict[int, Callable[[], StoreError]] = {
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
_POSTGRESQL: dict[str, Callable[[], StoreError]] = {
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


def _of_sqlite(error: sqlite3.Error) -> Callable[[], StoreError] | None:
    code = getattr(error, "sqlite_errorcode", None)
    if code is None or code == sqlite3.SQLITE_ERROR:
        # The statements are right: a name or a text that SQLite cannot read is damage.
        return damaged if str(error).startswith(("no such ", "Could not decode", "malformed ")) else None
    return _SQLITE.get(code & 0xFF)


def _of_postgresql(error: DBAPIError) -> Callable[[], StoreError] | None:
    state = getattr(error.orig, "sqlstate", None)
    if state is None:
        # Without a code it comes from the connection, not from the server.
        return StoreAwayError if error.connection_invalidated or isinstance(error, OperationalError) else None
    return next((found for begin, found in _POSTGRESQL.items() if state.startswith(begin)), None)
