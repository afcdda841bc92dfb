"""Maps by id, with revisions; every write is one transaction."""

from __future__ import annotations

import logging
import sqlite3
from collections.abc import Callable, Container, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Any, TypeVar

from sqlalchemy import URL, Connection, Row, Select, Table, bindparam, delete, func, insert, select, update
from sqlalchemy.exc import DBAPIError, IntegrityError

from ..database_location import file_of
from ..errors import (
    CorruptMapError,
    ReadOnlyStoreError,
    RevisionConflictError,
    StoreError,
    StoreFullError,
    UnknownMapError,
)
from .database import DatabaseFile, damaged, failures_as_store_errors, open_engine
from .tables import (
    ABSENT,
    NOTHING,
    MapOutline,
    MapPage,
    MapRecord,
    StoredMap,
    digest,
    documents,
    is_sealed,
    maps,
    record_of,
    require_tables,
    row_of,
)

T = TypeVar("T")
EVERY_REVISION = range(1, 1 << 63)
BEYOND = "\x7f"  # every letter that an id may have comes before it
BYTES_OF_ID = 500  # that an id takes in addition to its map, about
MOST_KNOWN = 4096  # records that are held until another is written
SHARE = 0.5  # of all bytes, that maps whose ids begin alike may take: as of memory, no key has more than half
logger = logging.getLogger("linefix")
_BY_ID = select(maps).where(maps.c.map_id == bindparam("which"))
_WHOLE = (
    select(maps, documents.c.document, documents.c.revision.label("document_revision"))
    .outerjoin(documents, documents.c.map_id == maps.c.map_id)
    .where(maps.c.map_id == bindparam("which"))
)


@dataclass(frozen=True, slots=True)
class Preconditions:
    """Conditions of a writer on the present revision.

    Attributes
    ----------
    if_match : container of int, or None
        Revisions of which the present one must be; `EVERY_REVISION` for ``If-Match: *``: there must be a map.
    if_none_match : container of int, or None
        Revisions that the present one must not be; `EVERY_REVISION` for ``If-None-Match: *``: there must be no map.
    """

    if_match: Container[int] | None = None
    if_none_match: Container[int] | None = None

    def check(self, revision: int | None) -> None:
        """Raise `RevisionConflictError` unless the present revision, None for no map, is as demanded."""
        for revisions, demanded in ((self.if_match, True), (self.if_none_match, False)):
            if revisions is not None and (revision is not None and revision in revisions) != demanded:
                raise RevisionConflictError(revision)


ANY = Preconditions()


class MapStore:
    """Keeps maps in a database; safe to use from several threads and processes.

    Parameters
    ----------
    url : URL
    may_make : bool
        True when a missing file of an SQLite database is made.
    most_bytes : int or None
        That all maps together may take; None for as many as the disk has. Writers at the same time may go beyond it,
        each by the map that it writes.

    Raises
    ------
    StoreError
        From every method: when the database is full, read-only, busy, damaged or away.
    """

    def __init__(self, url: URL, *, may_make: bool = True, most_bytes: int | None = None) -> None:
        path = file_of(url)
        self._file = None if path is None else DatabaseFile(path, may_make=may_make)
        self._engine = open_engine(url)
        self._writer = self._engine.execution_options(writes=True)
        self._at_once = open_engine(url, at_once=True)
        self._most_bytes = most_bytes
        self._opened = False
        self._watching: Any = None  # a connection of its own to the file
        self._version: object = None
        self._known: dict[str, MapRecord] = {}

    def open(self) -> None:
        """Make sure that the tables exist and are of this version; the other methods do it on their first use."""
        if self._file is not None:
            if self._opened and not self._file.is_the_same:
                # Connections to a file that was moved away keep using it: later readers would not find their writes.
                self.close()
            self._file.require()
        require_tables(self._engine, self._writer)
        self._opened = True

    def close(self) -> None:
        """Close all connections."""
        if self._watching is not None:
            self._watching.close()
            self._watching = None
        self._at_once.dispose()
        self._engine.dispose()

    def put(
        self, map_id: str, document: bytes, outline: MapOutline, demands: Preconditions = ANY, prefix: str = ""
    ) -> tuple[int, bool]:
        """Store a map; return its revision, and whether there was none before.

        Those whose ids begin with a `prefix`, that of the key that writes, may take `SHARE` of all bytes.

        The transaction is on the disk when this returns, and was read back. A damaged map is replaced as any other.
        """
        sha256 = digest(document)

        def write(connection: Connection) -> tuple[int, bool]:
            row, last, exists = _locked(connection, map_id)
            demands.check(last if exists else None)
            self._require_room(connection, map_id, len(document), prefix)
            record = MapRecord(map_id, last + 1, sha256, len(document), outline)
            if row is None:
                # Not an upsert: of two first writers one has to fail here, and look again.
                connection.execute(insert(maps), row_of(record))
            else:
                _update(connection, maps, row_of(record))
            content = {"map_id": map_id, "revision": record.revision, "document": document}
            if not _update(connection, documents, content):
                connection.execute(insert(documents), content)
            # If the tables themselves are damaged, rows may not come back as they were written: no commit then.
            if _stored(_found(connection, map_id, _WHOLE)).record != record:
                raise CorruptMapError
            return record.revision, not exists

        written = self._write(write)
        # In damaged tables another connection may read other rows than the one that wrote: look before promising.
        with suppress(UnknownMapError):  # deleted by another meanwhile
            self.load(map_id)
        return written

    def delete(self, map_id: str, demands: Preconditions = ANY) -> None:
        """Forget a map; the number of its last revision stays."""

        def write(connection: Connection) -> None:
            _, last, exists = _locked(connection, map_id)
            demands.check(last if exists else None)
            if not exists:
                raise UnknownMapError
            _update(connection, maps, row_of(MapRecord(map_id, last, ABSENT, 0, NOTHING)))
            connection.execute(delete(documents).where(documents.c.map_id == map_id))

        try:
            self._write(write)
        except StoreFullError:
            if self._file is None:
                raise
            with self._file.lending_reserve():
                self._write(write)

    def record(self, map_id: str) -> MapRecord:
        """Return the record of the present content; cheap, called before every use of a cached index."""
        self._require_open()
        found = self._looked_up(map_id)
        if found is not None:
            return found
        with self._reading() as connection:
            return _trusted(_found(connection, map_id, _BY_ID))

    def record_at_once(self, map_id: str) -> MapRecord | None:
        """Return the record of the present content if no wait is needed; None where `record` has to read it.

        A file is read in microseconds, and only if it was written to since the last look; while another process writes
        to it, this method does not wait. A server may take any time to answer.
        """
        if self._file is None or not self._opened or not self._file.is_the_same:
            return None
        try:
            watching = self._watching
            if watching is None:
                made = self._at_once.raw_connection()
                made.detach()  # not the pool's any more: versions of two connections have nothing in common
                self._watching = watching = made.dbapi_connection
                self._known.clear()
            version = watching.execute("PRAGMA data_version").fetchall()
        except (DBAPIError, sqlite3.Error):
            return None
        if version != self._version or len(self._known) >= MOST_KNOWN:
            self._known.clear()
            self._version = version
        found = self._known.get(map_id) or self._looked_up(map_id)
        if found is not None:
            self._known[map_id] = found  # one that is newer than this version goes at the next look
        return found

    def load(self, map_id: str) -> StoredMap:
        """Return a map, its checksum tested; a map that fails the test is quarantined."""
        with self._reading() as connection:
            row = _found(connection, map_id, _WHOLE)
        record = _trusted(row)
        try:
            return _stored(row)
        except CorruptMapError:
            self._quarantine(record)
            raise

    def list(self, limit: int, after: str, prefix: str = "") -> MapPage:
        """Return up to `limit` maps with an id beyond `after` that begins so, in the order of their ids' bytes."""
        query = select(maps).where(maps.c.map_id > after, maps.c.sha256 != ABSENT, *_begins(prefix))
        with self._reading() as connection:
            rows = connection.execute(query.order_by(maps.c.map_id).limit(limit + 1)).all()
        page = [(row.map_id, record_of(row)) for row in rows[:limit]]
        whole = [record for _, record in page if record is not None]
        damaged_ids = [map_id for map_id, record in page if record is None]
        return MapPage(whole, damaged_ids, page[-1][0] if len(rows) > limit else None)

    def _require_room(self, connection: Connection, map_id: str, size: int, prefix: str) -> None:
        if self._most_bytes is None:
            return
        size += BYTES_OF_ID
        if _taken(connection, map_id) + size > self._most_bytes:
            raise StoreFullError(
                f"with this map the store exceeds its limit of {self._most_bytes} bytes; delete "
                "maps, or raise the limit"
            )
        share = int(SHARE * self._most_bytes)
        if prefix and _taken(connection, map_id, prefix) + size > share:
            raise StoreFullError(
                f"the maps of this key's prefix may take {share} bytes, and with this one take more: delete some"
            )

    def _looked_up(self, map_id: str) -> MapRecord | None:
        """Return the record of a map that is there; None where `record` has to find out what is wrong."""
        try:
            with failures_as_store_errors(), self._at_once.connect() as connection:
                row = connection.execute(_BY_ID, {"which": map_id}).first()
        except StoreError:
            return None
        return None if row is None or row.sha256 == ABSENT else record_of(row)

    def _quarantine(self, record: MapRecord) -> None:
        """Mark a map as corrupt for all workers, also those that have it indexed, until it is put again."""
        logger.error("map quarantined: it does not match its checksum; put it again", extra={"map_id": record.map_id})
        same = (maps.c.map_id == record.map_id, maps.c.revision == record.revision)
        # If nothing can be written, the checksum still refuses the map.
        with suppress(StoreError), failures_as_store_errors(), self._writer.begin() as connection:
            connection.execute(update(maps).where(*same).values(quarantined=True))

    def _require_open(self) -> None:
        if not self._opened or (self._file is not None and not self._file.is_the_same):
            self.open()

    @contextmanager
    def _reading(self) -> Iterator[Connection]:
        self._require_open()
        with failures_as_store_errors(), self._engine.begin() as connection:
            yield connection

    def _write(self, write: Callable[[Connection], T]) -> T:
        """Write in a transaction, and again where the cause of the first failure may have passed."""
        self._require_open()
        try:
            return self._written(write)
        except IntegrityError:
            # Another worker put the same id for the first time between our look and our insert: now there is a row.
            try:
                return self._written(write)
            except IntegrityError as error:
                raise damaged() from error
        except ReadOnlyStoreError:
            # A connection made while nothing could be written stays so when the disk, or the server, is mended.
            self._engine.dispose()
            return self._written(write)

    def _written(self, write: Callable[[Connection], T]) -> T:
        with failures_as_store_errors(), self._writer.begin() as connection:
            return write(connection)


def _taken(connection: Connection, map_id: str, prefix: str = "") -> int:
    """Return the bytes that all maps with a prefix but one take; an id that was used once goes on taking some."""
    others = select(func.count(), func.sum(maps.c.size)).where(maps.c.map_id != map_id, *_begins(prefix))
    count, written = connection.execute(others).one()
    return BYTES_OF_ID * int(count) + int(written or 0)


def _begins(prefix: str) -> Sequence[Any]:
    """Return the condition that an id begins so."""
    return (maps.c.map_id.between(prefix, prefix + BEYOND),) if prefix else ()


def _found(connection: Connection, map_id: str, query: Select[Any]) -> Row[Any]:
    """Return what a query finds of a map."""
    row: Row[Any] | None = connection.execute(query, {"which": map_id}).first()
    if row is None and _document_revision(connection, map_id) is not None:
        # Put for the first time between the two looks; or else damage hides the row, which is never deleted.
        row = connection.execute(query, {"which": map_id}).first()
        if row is None:
            raise CorruptMapError
    if row is None or (row.sha256 == ABSENT and is_sealed(row)):
        raise UnknownMapError
    return row


def _trusted(row: Row[Any]) -> MapRecord:
    record = record_of(row)
    if record is None:
        raise CorruptMapError
    return record


def _stored(row: Row[Any]) -> StoredMap:
    """Return the map of a row that came with its document; raise `CorruptMapError` where it is another one."""
    record = _trusted(row)
    if row.document_revision != record.revision or digest(row.document) != record.sha256:
        raise CorruptMapError
    return StoredMap(record, row.document)


def _document_revision(connection: Connection, map_id: str) -> Any:
    return connection.scalar(select(documents.c.revision).where(documents.c.map_id == map_id))


def _locked(connection: Connection, map_id: str) -> tuple[Row[Any] | None, int, bool]:
    """Return a map's row, locked until the transaction ends, its last revision, 0 for none, and whether it is there."""
    row: Row[Any] | None = connection.execute(_BY_ID.with_for_update(), {"which": map_id}).first()
    if row is not None and is_sealed(row):
        return row, row.revision, row.sha256 != ABSENT
    # Of a damaged row neither number can be trusted; above both of them no tag was ever given out, as a rule.
    said = (None if row is None else row.revision, _document_revision(connection, map_id))
    numbers = [number for number in said if isinstance(number, int)]
    return row, max(numbers, default=0), row is not None or bool(numbers)


def _update(connection: Connection, table: Table, values: dict[str, Any]) -> bool:
    """Overwrite the row of a map; return whether there was one.

    The values are not part of the statement: SQLAlchemy keeps those, and would keep the first document for good.
    """
    rest = {name: value for name, value in values.items() if name != "map_id"}
    same = table.c.map_id == bindparam("which")
    return connection.execute(update(table).where(same), {"which": values["map_id"], **rest}).rowcount > 0
