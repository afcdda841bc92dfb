"""Maps by id, with revisions; every call is one transaction."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

from sqlalchemy import URL, Connection, Engine, Row, Select, Table, bindparam, delete, func, insert, select, update
from sqlalchemy.exc import IntegrityError

from ..database_location import file_of
from .database import DatabaseFile, open_engine
from .errors import CorruptMapError, ReadOnlyStoreError, StoreError, StoreFullError, UnknownMapError
from .failures import damaged, failures_as_store_errors
from .preconditions import Preconditions
from .record_reader import RecordReader
from .records import (
    ABSENT,
    NOTHING,
    MapOutline,
    MapPage,
    MapRecord,
    MapSummary,
    StoredMap,
    columns_of,
    digest,
    is_sealed,
)
from .schema import documents, maps, upgrade

T = TypeVar("T")
BEYOND = "\x7f"  # every letter that an id may have comes before it
logger = logging.getLogger("linefix")

BYTES_OF_ID = 500  # that an id takes in addition to its map, about
SHARE = 0.5  # of all bytes, that maps whose ids begin alike may take: as of memory, no key has more than half


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
        self._engine: Engine = open_engine(url)
        self._writer = self._engine.execution_options(writes=True)
        self._most_bytes = most_bytes
        self._reader = RecordReader(open_engine(url, keeps_statements=True))
        self._opened = False

    def open(self) -> None:
        """Make sure that the tables exist and are of this version; the other methods do it on their first use."""
        if self._file is not None:
            if self._opened and not self._file.is_the_same:
                # Connections to a file that was moved away keep using it: later readers would not find their writes.
                self.close()
            self._file.require()
        upgrade(self._engine, self._writer)
        self._opened = True

    def close(self) -> None:
        """Close all connections."""
        self._reader.close()
        self._engine.dispose()

    def put(
        self, map_id: str, document: bytes, outline: MapOutline, demands: Preconditions, prefix: str = ""
    ) -> tuple[int, bool]:
        """Store a map; return its revision, and whether there was none before.

        Those whose ids begin with a `prefix`, that of the key that writes, may take `SHARE` of all bytes.

        The transaction is on the disk when this returns, and was read back. A damaged map is replaced as any other.
        """
        written = self._twice(lambda: self._put(map_id, document, outline, demands, prefix))
        # In damaged tables another connection may read other rows than the one that wrote: look before promising.
        with suppress(UnknownMapError):  # deleted by another meanwhile
            self.load(map_id)
        return written

    def _put(
        self, map_id: str, document: bytes, outline: MapOutline, demands: Preconditions, prefix: str
    ) -> tuple[int, bool]:
        with self._writing() as connection:
            row = _locked(connection, map_id)
            last, exists = _last(connection, map_id, row)
            demands.check(last if exists else None)
            self._require_room(connection, map_id, len(document), prefix)
            record = MapRecord(map_id, last + 1, digest(document), outline.oriented)
            if row is None:
                # Not an upsert: of two first writers one has to fail here, and look again.
                connection.execute(insert(maps), columns_of(record, outline))
            else:
                _update(connection, maps, columns_of(record, outline))
            content = {"map_id": map_id, "revision": record.revision, "document": document}
            if not _update(connection, documents, content):
                connection.execute(insert(documents), content)
            # If the tables themselves are damaged, rows may not come back as they were written: no commit then.
            back = _whole(connection, map_id)
            if _trusted(back) != record or not _matches(back, record):
                raise CorruptMapError
        return record.revision, not exists

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

    def delete(self, map_id: str, demands: Preconditions) -> None:
        """Forget a map; the number of its last revision stays."""
        self._twice(lambda: self._delete(map_id, demands))

    def _delete(self, map_id: str, demands: Preconditions) -> None:
        with self._writing() as connection:
            last, exists = _last(connection, map_id, _locked(connection, map_id))
            demands.check(last if exists else None)
            if not exists:
                raise UnknownMapError
            _update(connection, maps, columns_of(MapRecord(map_id, last, ABSENT), NOTHING))
            connection.execute(delete(documents).where(documents.c.map_id == map_id))

    def record(self, map_id: str) -> MapRecord:
        """Return the record of the present content; cheap, called before every use of a cached index."""
        self._require_open()
        found = self._reader.read(map_id)
        if found is not None:
            return found
        with self._reading() as connection:
            return _trusted(_row(connection, map_id, select(maps)))

    def record_at_once(self, map_id: str) -> MapRecord | None:
        """Return the record of the present content if no wait is needed; None where `record` has to read it.

        A file is read in microseconds; while another process writes to it, this method does not wait. A server may
        take any time to answer.
        """
        if self._file is None or not self._opened or not self._file.is_the_same:
            return None
        return self._reader.read(map_id, may_connect=False)

    def load(self, map_id: str) -> StoredMap:
        """Return a map, its checksum tested; a map that fails the test is quarantined."""
        with self._reading() as connection:
            row = _whole(connection, map_id)
        record = _trusted(row)
        if not _matches(row, record):
            self._quarantine(record)
            raise CorruptMapError
        return StoredMap(record, row.document)

    def list(self, limit: int, after: str, prefix: str = "") -> MapPage:
        """Return up to `limit` maps with an id beyond `after` that begins so, in the order of their ids' bytes."""
        query = select(maps).where(maps.c.map_id > after, maps.c.sha256 != ABSENT)
        if prefix:
            query = query.where(maps.c.map_id.between(prefix, prefix + BEYOND))
        with self._reading() as connection:
            rows = connection.execute(query.order_by(maps.c.map_id).limit(limit + 1)).all()
        page = rows[:limit]
        whole = [_summary(row) for row in page if is_sealed(row) and not row.quarantined]
        damaged = [row.map_id for row in page if not is_sealed(row) or row.quarantined]
        return MapPage(whole, damaged, page[-1].map_id if len(rows) > limit else None)

    def _quarantine(self, record: MapRecord) -> None:
        """Mark a map as corrupt for all workers, also those that have it indexed, until it is put again."""
        logger.error("map quarantined: it does not match its checksum; put it again", extra={"map_id": record.map_id})
        same = (maps.c.map_id == record.map_id, maps.c.revision == record.revision)
        # If nothing can be written, the checksum still refuses the map.
        with suppress(StoreError), self._writing() as connection:
            connection.execute(update(maps).where(*same).values(quarantined=True))

    def _require_open(self) -> None:
        if not self._opened or (self._file is not None and not self._file.is_the_same):
            self.open()

    @contextmanager
    def _reading(self) -> Iterator[Connection]:
        self._require_open()
        with failures_as_store_errors(), self._engine.begin() as connection:
            yield connection

    @contextmanager
    def _writing(self) -> Iterator[Connection]:
        self._require_open()
        with failures_as_store_errors(), self._writer.begin() as connection:
            yield connection

    def _twice(self, write: Callable[[], T]) -> T:
        """Write, and repeat once where the cause of the first failure may have passed."""
        try:
            return write()
        except IntegrityError:
            # Another worker put the same id for the first time between our look and our insert: now there is a row.
            try:
                return write()
            except IntegrityError as error:
                raise damaged() from error
        except ReadOnlyStoreError:
            # A connection made while nothing could be written stays so when the disk, or the server, is mended.
            self._engine.dispose()
            return write()


def _taken(connection: Connection, map_id: str, prefix: str = "") -> int:
    """Return the bytes that all maps with a prefix but one take; an id that was used once goes on taking some."""
    others = select(func.count()).select_from(maps).where(maps.c.map_id != map_id)
    written = select(func.sum(func.length(documents.c.document))).where(documents.c.map_id != map_id)
    if prefix:
        others = others.where(maps.c.map_id.between(prefix, prefix + BEYOND))
        written = written.where(documents.c.map_id.between(prefix, prefix + BEYOND))
    return BYTES_OF_ID * (connection.scalar(others) or 0) + int(connection.scalar(written) or 0)


def _whole(connection: Connection, map_id: str) -> Row[Any]:
    """Return a map's row with its document."""
    both = select(maps, documents.c.document, documents.c.revision.label("document_revision"))
    return _row(connection, map_id, both.outerjoin(documents, documents.c.map_id == maps.c.map_id))


def _matches(row: Row[Any], record: MapRecord) -> bool:
    """Return whether the document that came with a row is the one that its record names."""
    return bool(row.document_revision == record.revision and digest(row.document) == record.sha256)


def _row(connection: Connection, map_id: str, columns: Select[Any]) -> Row[Any]:
    """Return some columns of a map's row."""
    query = columns.where(maps.c.map_id == map_id)
    row: Row[Any] | None = connection.execute(query).first()
    if row is None and _document_revision(connection, map_id) is not None:
        # Put for the first time between the two looks; or else damage hides the row, which is never deleted.
        row = connection.execute(query).first()
        if row is None:
            raise CorruptMapError
    if row is None or (row.sha256 == ABSENT and is_sealed(row)):
        raise UnknownMapError
    return row


def _trusted(row: Row[Any]) -> MapRecord:
    if row.quarantined or not is_sealed(row):
        raise CorruptMapError
    return MapRecord(row.map_id, row.revision, row.sha256, row.oriented)


def _document_revision(connection: Connection, map_id: str) -> Any:
    return connection.execute(select(documents.c.revision).where(documents.c.map_id == map_id)).scalar()


def _locked(connection: Connection, map_id: str) -> Row[Any] | None:
    """Return a map's row, locked against changes until the transaction ends."""
    row: Row[Any] | None = connection.execute(select(maps).where(maps.c.map_id == map_id).with_for_update()).first()
    return row


def _last(connection: Connection, map_id: str, row: Row[Any] | None) -> tuple[int, bool]:
    """Return the last revision of an id, 0 for one never used, and whether a map is there."""
    if row is not None and is_sealed(row):
        return row.revision, row.sha256 != ABSENT
    # Of a damaged row neither number can be trusted; above both of them no tag was ever given out, as a rule.
    said = (None if row is None else row.revision, _document_revision(connection, map_id))
    numbers = [number for number in said if isinstance(number, int)]
    return max(numbers, default=0), row is not None or bool(numbers)


def _update(connection: Connection, table: Table, values: dict[str, Any]) -> bool:
    """Overwrite the row of a map; return whether there was one.

    The values are not part of the statement: SQLAlchemy keeps those, and would keep the first document for good.
    """
    rest = {name: value for name, value in values.items() if name != "map_id"}
    same = table.c.map_id == bindparam("which")
    return connection.execute(update(table).where(same), {"which": values["map_id"], **rest}).rowcount > 0


def _summary(row: Row[Any]) -> MapSummary:
    bounds = row.min_x, row.min_y, row.max_x, row.max_y
    return MapSummary(row.map_id, row.revision, MapOutline(row.segments, bounds, row.sigma, row.oriented))
