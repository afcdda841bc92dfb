"""Connections to the database behind the map store, so set that committed data stays committed."""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Engine, create_engine, event
from sqlalchemy.engine import Connection

from ..database_location import file_of, make_file
from .errors import ReadOnlyStoreError, StoreAwayError

BUSY_SECONDS = 5.0
# Up to 3.51.2 a WAL that is reset while another connection checkpoints can corrupt the database.
SAFE_WAL = (3, 51, 3)


def open_engine(url: URL, *, keeps_statements: bool = False) -> Engine:
    """Return an engine; nothing is opened yet.

    A file of SQLite's is opened where there is one, and never made: see `DatabaseFile`.

    Parameters
    ----------
    url : URL
    keeps_statements : bool
        True when SQLite keeps its prepared statements: not where these take documents. A statement that is kept
        keeps its last arguments, 15 MB on each connection.
    """
    if url.get_backend_name() == "sqlite":
        # No bound on connections: each is used by one thread, whose number is bounded elsewhere.
        waits = {"timeout": BUSY_SECONDS, "cached_statements": 16 if keeps_statements else 0}
        path = file_of(url)
        if path is not None:
            url = url.set(database=path.as_uri()).update_query_dict({"mode": "rw", "uri": "true"})
        engine = create_engine(url, connect_args=waits, max_overflow=-1)
        event.listen(engine, "connect", _prepare_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
        return engine
    # A server that vanished from the network must not hold a thread for ever.
    waits = {"connect_timeout": 3, "tcp_user_timeout": 10_000}
    unsaid = {name: value for name, value in waits.items() if name not in url.query}
    engine = create_engine(url, connect_args=unsaid, pool_pre_ping=True, pool_timeout=BUSY_SECONDS, max_overflow=20)
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
        if self._known is None and self._may_make and not self._path.exists():
            self._make()
        try:
            found = os.stat(self._path)
        except OSError as error:
            raise StoreAwayError(
                "the database file of the maps is missing; restore it, or restart the service for an empty one"
            ) from error
        self._known = (found.st_dev, found.st_ino)
        self._may_make = False

    @property
    def is_the_same(self) -> bool:
        """Return whether the file is the one that was found last."""
        try:
            found = os.stat(self._path)
        except OSError:
            return False
        return self._known == (found.st_dev, found.st_ino)

    def _make(self) -> None:
        try:
            make_file(self._path)
        except OSError as error:
            raise ReadOnlyStoreError(
                "the database file of the maps, or its folder, cannot be created; check the permissions"
            ) from error


def _prepare_sqlite(connection: Any, _: Any) -> None:
    connection.isolation_level = None  # transactions begin in _begin_sqlite, not where the driver guesses
    wanted = "WAL" if sqlite3.sqlite_version_info >= SAFE_WAL else "DELETE"
    cursor = connection.cursor()
    try:
        cursor.execute("PRAGMA cell_size_check=ON")
        mode = cursor.execute(f"PRAGMA journal_mode={wanted}").fetchone()[0]
        # With a rollback journal a commit is one only when the journal is gone, after a power cut too: EXTRA syncs the
        # directory that it was deleted from.
        cursor.execute(f"PRAGMA synchronous={'FULL' if mode == 'wal' else 'EXTRA'}")
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode & 0xFF not in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN):
            raise
    finally:
        cursor.close()


def _begin_sqlite(connection: Connection) -> None:
    writes = connection.get_execution_options().get("writes", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


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
