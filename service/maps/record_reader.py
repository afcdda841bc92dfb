"""The identity of a map, read on a connection that stays open, by one short statement and without the toolkit.

The service reads it before every use of a cached index and caches nothing. The result is the state that is committed by
now, in whichever process.
"""

from __future__ import annotations

from typing import Any

from sqlalchemy import Engine
from sqlalchemy.exc import SQLAlchemyError

from .records import ABSENT, SEALED, MapRecord, seal
from .schema import maps


class RecordReader:
    """Reads records; safe to use from several threads, each of which has a connection to itself meanwhile.

    Parameters
    ----------
    engine : Engine
        Opens the connections.
    """

    def __init__(self, engine: Engine) -> None:
        self._engine = engine
        self._on_sqlite = engine.dialect.name == "sqlite"
        # Of the driver in use: another need not be loaded, nor be there.
        self._driver_error: type[Exception] = engine.dialect.loaded_dbapi.Error
        mark = "?" if self._on_sqlite else "%s"
        self._statement = f"SELECT {', '.join(SEALED)}, seal, quarantined FROM {maps.name} WHERE map_id = {mark}"
        self._idle: list[Any] = []

    def read(self, map_id: str, *, may_connect: bool = True) -> MapRecord | None:
        """Return what identifies the present content of a map.

        None where there is no such map, it is damaged, or the database does not answer: which of these the store finds
        out, on a connection of its own. Also where a connection would have to be made that may not be.
        """
        idle = self._idle
        if not idle and not may_connect:
            return None
        connection = None
        try:
            connection = idle.pop() if idle else self._connect()
            rows = connection.execute(self._statement, (map_id,)).fetchall()
        except (SQLAlchemyError, self._driver_error, UnicodeDecodeError):
            if connection is not None:
                connection.close()
            return None
        if idle is self._idle:
            idle.append(connection)
        else:  # closed meanwhile
            connection.close()
        return _record_of(rows[0]) if rows else None

    def close(self) -> None:
        """Close the connections; those in use when they are done. A later call opens others."""
        idle, self._idle = self._idle, []
        for connection in idle:
            connection.close()

    def _connect(self) -> Any:
        opened = self._engine.raw_connection()
        connection: Any = opened.driver_connection
        opened.detach()
        if self._on_sqlite:
            connection.execute("PRAGMA busy_timeout=0")  # the caller's next attempt waits for writers
        else:
            connection.autocommit = True
        return connection


def _record_of(row: tuple[Any, ...]) -> MapRecord | None:
    """Return the record of a row as a driver gives it; None of one that is damaged, quarantined or of no map."""
    *said, oriented, sealed, quarantined = row
    oriented = None if oriented is None else bool(oriented)  # SQLite has no such type
    map_id, revision, sha256 = said[:3]
    if quarantined or sha256 == ABSENT or sealed != seal(*said, oriented):
        return None
    return MapRecord(map_id, revision, sha256, oriented)
