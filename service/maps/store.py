"""Maps by id, with revisions; every call is one transaction."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, Row, insert, inspect, literal, select, update
from sqlalchemy.engine import make_url
from sqlalchemy.exc import IntegrityError

from ..problems import ProblemError
from .database import failures_as_problems, maps, metadata, open_engine

Bounds = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class MapRecord:
    """What identifies the content of a stored map."""

    map_id: str
    revision: int
    sha256: str


@dataclass(frozen=True, slots=True)
class MapSummary:
    """A stored map without its content; bounds are ``min_x, min_y, max_x, max_y`` in metres."""

    map_id: str
    revision: int
    segments: int
    bounds: Bounds


@dataclass(frozen=True, slots=True)
class StoredMap:
    """A stored map: its JSON document to the byte."""

    record: MapRecord
    document: bytes


@dataclass(frozen=True, slots=True)
class Preconditions:
    """What a writer demands of the present revision.

    Attributes
    ----------
    if_match : frozenset of int, or None
        Revisions of which the present one must be.
    any_match : bool
        ``If-Match: *``: there must be a map.
    if_none_match : frozenset of int, or None
        Revisions that the present one must not be.
    none_may_exist : bool
        ``If-None-Match: *``: there must be no map.
    """

    if_match: frozenset[int] | None = None
    any_match: bool = False
    if_none_match: frozenset[int] | None = None
    none_may_exist: bool = False

    def check(self, revision: int | None) -> None:
        """Raise when the present revision, None for no map, is not as demanded."""
        present = revision is not None
        refused = (
            (self.any_match and not present)
            or (self.if_match is not None and revision not in self.if_match)
            or (self.none_may_exist and present)
            or (self.if_none_match is not None and present and revision in self.if_none_match)
        )
        if refused:
            raise ProblemError("revision_conflict", "the map's present revision is not the one demanded")


class MapStore:
    """Keeps maps in a database; safe to use from several threads and processes.

    Raises
    ------
    ProblemError
        From every method: when the database is full, read-only, busy, damaged or away.
    """

    def __init__(self, url: str) -> None:
        self._url = make_url(url)
        self._engine: Engine = open_engine(url)
        self._writer = self._engine.execution_options(writes=True)

    def open(self) -> None:
        """Make sure that directory and tables exist."""
        if self._url.get_backend_name() == "sqlite" and self._url.database:
            try:
                Path(self._url.database).parent.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise ProblemError("read_only", "the directory of the maps cannot be made") from error
        with failures_as_problems(), self._engine.connect() as connection:
            there = inspect(connection).has_table(maps.name)
        if not there:
            with self._writing() as connection:
                metadata.create_all(connection)

    def close(self) -> None:
        """Close all connections."""
        self._engine.dispose()

    def ping(self) -> None:
        """Return when the store answers."""
        with self._reading() as connection:
            connection.execute(select(literal(1)).select_from(maps).limit(1)).first()

    def put(
        self, map_id: str, document: bytes, summary: tuple[int, Bounds], demands: Preconditions
    ) -> tuple[int, bool]:
        """Store a map; return its revision, and whether there was none before.

        The transaction is on the disk when this returns.
        """
        try:
            return self._put(map_id, document, summary, demands)
        except IntegrityError:
            # Another worker put the same id for the first time between our look and our insert: now there is a row.
            return self._put(map_id, document, summary, demands)

    def _put(
        self, map_id: str, document: bytes, summary: tuple[int, Bounds], demands: Preconditions
    ) -> tuple[int, bool]:
        segments, (min_x, min_y, max_x, max_y) = summary
        values: dict[str, Any] = {
            "document": document,
            "sha256": hashlib.sha256(document).hexdigest(),
            "segments": segments,
            "min_x": min_x,
            "min_y": min_y,
            "max_x": max_x,
            "max_y": max_y,
        }
        with self._writing() as connection:
            last, exists = _locked(connection, map_id)
            demands.check(last if exists else None)
            revision = (last or 0) + 1
            if last is None:
                connection.execute(insert(maps).values(map_id=map_id, revision=revision, **values))
            else:
                connection.execute(update(maps).where(maps.c.map_id == map_id).values(revision=revision, **values))
        return revision, not exists

    def delete(self, map_id: str, demands: Preconditions) -> None:
        """Forget a map; the number of its last revision is kept."""
        with self._writing() as connection:
            last, exists = _locked(connection, map_id)
            demands.check(last if exists else None)
            if not exists:
                raise unknown_map()
            connection.execute(update(maps).where(maps.c.map_id == map_id).values(document=None, sha256="", segments=0))

    def record(self, map_id: str) -> MapRecord:
        """Return what identifies the present content; cheap, asked before every use of a cached index."""
        with self._reading() as connection:
            columns = (maps.c.revision, maps.c.sha256)
            row = connection.execute(
                select(*columns).where(maps.c.map_id == map_id, maps.c.document.is_not(None))
            ).first()
        if row is None:
            raise unknown_map()
        return MapRecord(map_id, row.revision, row.sha256)

    def load(self, map_id: str) -> StoredMap:
        """Return a map, its checksum tested."""
        with self._reading() as connection:
            columns = (maps.c.revision, maps.c.sha256, maps.c.document)
            row = connection.execute(
                select(*columns).where(maps.c.map_id == map_id, maps.c.document.is_not(None))
            ).first()
        if row is None:
            raise unknown_map()
        if hashlib.sha256(row.document).hexdigest() != row.sha256:
            raise ProblemError("map_corrupt", "the stored map does not match its checksum; put it again")
        return StoredMap(MapRecord(map_id, row.revision, row.sha256), row.document)

    def list(self, limit: int, after: str) -> tuple[list[MapSummary], str | None]:
        """Return up to `limit` maps with an id beyond `after`, and where to go on."""
        columns = [column for column in maps.c if column.name not in ("document", "sha256")]
        query = select(*columns).where(maps.c.map_id > after, maps.c.document.is_not(None))
        with self._reading() as connection:
            rows = connection.execute(query.order_by(maps.c.map_id).limit(limit + 1)).all()
        found = [_summary(row) for row in rows[:limit]]
        return found, found[-1].map_id if len(rows) > limit else None

    @contextmanager
    def _reading(self) -> Iterator[Connection]:
        with failures_as_problems(), self._engine.begin() as connection:
            yield connection

    @contextmanager
    def _writing(self) -> Iterator[Connection]:
        with failures_as_problems(), self._writer.begin() as connection:
            yield connection


def unknown_map() -> ProblemError:
    """Return the problem of an id that nothing is stored under."""
    return ProblemError("unknown_map", "no map is stored under this id")


def _locked(connection: Connection, map_id: str) -> tuple[int | None, bool]:
    """Return the last revision of an id, None for an id never used, and whether a map is there; the row is locked."""
    columns = (maps.c.revision, maps.c.document.is_not(None).label("there"))
    row = connection.execute(select(*columns).where(maps.c.map_id == map_id).with_for_update()).first()
    return (None, False) if row is None else (row.revision, bool(row.there))


def _summary(row: Row[Any]) -> MapSummary:
    return MapSummary(row.map_id, row.revision, row.segments, (row.min_x, row.min_y, row.max_x, row.max_y))
