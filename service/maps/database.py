"""Connections to the database behind the map store, so set that what is committed stays committed."""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Engine, create_engine, event
from sqlalchemy.engine import Connection

from .errors import ReadOnlyStoreError

BUSY_SECONDS = 5.0
# Up to 3.51.2 a WAL that is reset while another connection checkpoints can corrupt the database.
SAFE_WAL = (3, 51, 3)


def open_engine(url: URL) -> Engine:
    """Return an engine; nothing is opened yet."""
    if url.get_backend_name() == "sqlite":
        # No bound on connections: each is used by one thread, whose number is bounded elsewhere.
        # A statement that is kept keeps what it was last given, a document of 15 MB for each and every connection.
        waits = {"timeout": BUSY_SECONDS, "cached_statements": 0}
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


def make_directory(url: URL) -> None:
    """Make the directory of a database file, and sync the one that it appears in.

    Raises
    ------
    ReadOnlyStoreError
        When it cannot be made.
    """
    if url.get_backend_name() != "sqlite" or not url.database or url.database == ":memory:" or "uri" in url.query:
        return
    folder = Path(url.database).absolute().parent
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for made in missing:
            _sync(made.parent)
    except OSError as error:
        raise ReadOnlyStoreError("the directory of the maps cannot be made") from error


def _sync(folder: Path) -> None:
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)


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
