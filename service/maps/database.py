"""The database behind the map store: tables, connections, and what its failures mean."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from sqlalchemy import Column, Engine, Float, Integer, LargeBinary, MetaData, String, Table, create_engine, event
from sqlalchemy.engine import Connection, make_url
from sqlalchemy.exc import DBAPIError

from ..problems import ProblemError

metadata = MetaData()
maps = Table(
    "maps",
    metadata,
    # Compared byte by byte whatever the database's collation, so that the order of a listing is one.
    Column("map_id", String(128, collation=None), primary_key=True),
    Column("revision", Integer, nullable=False),
    # A deleted map keeps its row without a document: its next revision is a new number, so that an old ETag never
    # matches a new map.
    Column("document", LargeBinary, nullable=True),
    Column("sha256", String(64), nullable=False),
    Column("segments", Integer, nullable=False),
    Column("min_x", Float, nullable=False),
    Column("min_y", Float, nullable=False),
    Column("max_x", Float, nullable=False),
    Column("max_y", Float, nullable=False),
)

BUSY_SECONDS = 5.0
# Up to 3.51.2 a WAL that is reset while another process checkpoints can corrupt the database.
SAFE_WAL = (3, 51, 3)


def open_engine(url: str) -> Engine:
    """Return an engine; nothing is opened yet."""
    if make_url(url).get_backend_name() != "sqlite":
        return create_engine(url, pool_pre_ping=True)
    engine = create_engine(url, connect_args={"timeout": BUSY_SECONDS})
    event.listen(engine, "connect", _prepare_sqlite)
    event.listen(engine, "begin", _begin_sqlite)
    return engine


def _prepare_sqlite(connection: Any, _: Any) -> None:
    connection.isolation_level = None  # transactions begin in _begin_sqlite, not where the driver guesses
    cursor = connection.cursor()
    try:
        if sqlite3.sqlite_version_info >= SAFE_WAL:
            cursor.execute("PRAGMA journal_mode=WAL")
            cursor.execute("PRAGMA synchronous=FULL")
        else:
            # EXTRA also syncs the directory once the journal is gone: only then is a commit one after a power cut.
            cursor.execute("PRAGMA journal_mode=DELETE")
            cursor.execute("PRAGMA synchronous=EXTRA")
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode & 0xFF not in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN):
            raise
    finally:
        cursor.close()


def _begin_sqlite(connection: Connection) -> None:
    writes = connection.get_execution_options().get("writes", False)
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


@contextmanager
def failures_as_problems() -> Iterator[None]:
    """Turn what a database can refuse into problems; anything else is a defect and passes through."""
    try:
        yield
    except DBAPIError as error:
        problem = _problem_of(error)
        if problem is None:
            raise
        raise problem from error


def _problem_of(error: DBAPIError) -> ProblemError | None:
    if isinstance(error.orig, sqlite3.Error):
        return _sqlite_problem(getattr(error.orig, "sqlite_errorcode", 0) & 0xFF)
    state = str(getattr(error.orig, "sqlstate", None) or "")
    if state.startswith("53100"):
        return ProblemError("storage_full", "the database has no space left")
    if state == "25006":
        return ProblemError("read_only", "the database takes no writes")
    if error.connection_invalidated or state.startswith(("08", "57P", "53")):
        return ProblemError("not_ready", "the database does not answer")
    return None


def _sqlite_problem(code: int) -> ProblemError | None:
    if code == sqlite3.SQLITE_FULL:
        return ProblemError("storage_full", "the disk that holds the maps is full")
    if code in (sqlite3.SQLITE_READONLY, sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_IOERR, sqlite3.SQLITE_PERM):
        return ProblemError("read_only", "the maps cannot be written")
    if code in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED):
        return ProblemError("overloaded", "the store is busy with other writes")
    if code in (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB):
        return ProblemError("map_corrupt", "the database that holds the maps is damaged")
    return None
