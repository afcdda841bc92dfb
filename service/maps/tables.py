"""The tables of the map store, created where there are none and refused where they are others; records of stored maps.

A row of `maps` is short, since it is read before every search. A map that was deleted keeps its row with an empty
sha256: its next revision is a new number, and an old ETag never matches a new map.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from operator import attrgetter
from typing import Any

from sqlalchemy import (
    Boolean,
    Column,
    Connection,
    Engine,
    Float,
    Integer,
    LargeBinary,
    MetaData,
    Row,
    String,
    Table,
    inspect,
    select,
    text,
)

from ..errors import StoreAwayError
from .database import damaged, failures_as_store_errors

VERSION = 1  # of the tables; a change of them is a new one
ABSENT = ""  # the sha256 of a map that was deleted
_ADVISORY_LOCK = 0x6C696E65666978  # "linefix"
# Compared byte by byte whatever the database's collation, so that the order of a listing is one.
_MAP_ID = String(128).with_variant(String(128, collation="C"), "postgresql")

metadata = MetaData()
versions = Table("linefix_schema", metadata, Column("version", Integer, primary_key=True, autoincrement=False))
maps = Table(
    "maps",
    metadata,
    Column("map_id", _MAP_ID, primary_key=True),
    Column("revision", Integer, nullable=False),
    Column("sha256", String(64), nullable=False),
    Column("size", Integer, nullable=False),
    Column("segments", Integer, nullable=False),
    Column("points", Integer, nullable=False),
    *(Column(name, Float, nullable=False) for name in ("min_x", "min_y", "max_x", "max_y")),
    Column("sigma", Float),
    Column("oriented", Boolean),
    Column("seal", String(64), nullable=False),
    Column("quarantined", Boolean, nullable=False),
)
# Id and revision stand here a second time: they remain where damage hides a row of `maps`.
documents = Table(
    "map_documents",
    metadata,
    Column("map_id", _MAP_ID, primary_key=True),
    Column("revision", Integer, nullable=False),
    Column("document", LargeBinary, nullable=False),
)
_SEALED = tuple(column.name for column in maps.columns if column.name not in ("seal", "quarantined"))
_sealed_values = attrgetter(*_SEALED)


@dataclass(frozen=True, slots=True)
class MapOutline:
    """The properties of a map without its content.

    Attributes
    ----------
    segments, points : int
        Their numbers.
    bounds : tuple
        ``min_x, min_y, max_x, max_y``, metres.
    sigma : float, or None
        Standard deviation of its lines, metres; None where the map does not state it.
    oriented : bool, or None
        True when directions of its segments mean anything; None where the map does not state it.
    """

    segments: int
    points: int
    bounds: tuple[float, float, float, float]
    sigma: float | None = None
    oriented: bool | None = None

    def as_json(self, map_id: str, revision: int) -> dict[str, Any]:
        """Return the summary of a stored map as the contract has it."""
        return {
            "map_id": map_id,
            "revision": revision,
            "segment_count": self.segments,
            "bounds": self.bounds,
            "sigma": self.sigma,
            "oriented": self.oriented,
        }


NOTHING = MapOutline(0, 0, (0.0, 0.0, 0.0, 0.0))
"""Of a map that was deleted."""


@dataclass(frozen=True, slots=True)
class MapRecord:
    """A stored map without its content, which `sha256` and `size`, bytes, are of."""

    map_id: str
    revision: int
    sha256: str
    size: int
    outline: MapOutline

    @property
    def oriented(self) -> bool | None:
        """Return whether directions of its segments mean anything; None where the map does not state it."""
        return self.outline.oriented

    def as_json(self) -> dict[str, Any]:
        """Return the summary of the map as the contract has it."""
        return self.outline.as_json(self.map_id, self.revision)


@dataclass(frozen=True, slots=True)
class StoredMap:
    """A stored map: its JSON document to the byte."""

    record: MapRecord
    document: bytes


@dataclass(frozen=True, slots=True)
class MapPage:
    """A page of a listing: maps, ids of damaged ones, and the id to go on from, None on the last page."""

    maps: list[MapRecord]
    corrupt: list[str]
    next: str | None


def require_tables(engine: Engine, writer: Engine) -> None:
    """Create the tables where there are none; write nothing where they are there.

    Workers that start together wait for the first of them: for SQLite's write lock, or for an advisory lock.

    Raises
    ------
    StoreError
        When the database does not take them, or has tables of another version.
    """
    with failures_as_store_errors(), engine.begin() as connection:
        if _are_there(connection):
            return
    with failures_as_store_errors(), writer.begin() as connection:
        if connection.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _ADVISORY_LOCK})
        if not _are_there(connection):
            metadata.create_all(connection)
            connection.execute(versions.insert().values(version=VERSION))


def _are_there(connection: Connection) -> bool:
    """Return whether the tables are there; raise `StoreError` where they are not those above."""
    wanted = {name: set(table.columns.keys()) for name, table in metadata.tables.items()}
    there = _found(connection)
    if 0 < len(there) < len(wanted):  # another worker has just created them, all in one transaction
        there = _found(connection)
    if not there:
        return False
    version = None
    if there.get(versions.name) == wanted[versions.name]:
        version = connection.scalar(select(versions.c.version))
    if version != VERSION:
        raise StoreAwayError(
            "the database has the tables of another version of the service, or of another program; start that "
            "version, or name another database"
        )
    if there != wanted:
        raise damaged()
    return True


def _found(connection: Connection) -> dict[str, set[str]]:
    """Return the columns of those of the tables that are there."""
    found = inspect(connection)
    names = [name for name in metadata.tables if found.has_table(name)]
    return {name: set(connection.execute(text(f"SELECT * FROM {name} LIMIT 0")).keys()) for name in names}


def digest(document: object) -> str:
    """Return the SHA-256 of a document; of a value that is no bytes, as after damage, text that never matches."""
    return hashlib.sha256(document).hexdigest() if isinstance(document, bytes) else "damaged"


def row_of(record: MapRecord) -> dict[str, Any]:
    """Return a row of `maps` with its seal: a bit that flips in a revision is found as surely as one in a document."""
    outline = record.outline
    # SQLite does not keep the sign of zero.
    numbers = tuple(None if value is None else value + 0.0 for value in (*outline.bounds, outline.sigma))
    told = record.map_id, record.revision, record.sha256, record.size, outline.segments, outline.points
    values = *told, *numbers, outline.oriented
    return dict(zip(_SEALED, values, strict=True)) | {"seal": _seal(values), "quarantined": False}


def is_sealed(row: Row[Any]) -> bool:
    """Return whether a row of `maps` is as it was written."""
    return bool(row.seal == _seal(_sealed_values(row)))


def record_of(row: Row[Any]) -> MapRecord | None:
    """Return the record of a row; None of one that is damaged or quarantined."""
    if row.quarantined or not is_sealed(row):
        return None
    bounds = row.min_x, row.min_y, row.max_x, row.max_y
    outline = MapOutline(row.segments, row.points, bounds, row.sigma, row.oriented)
    return MapRecord(row.map_id, row.revision, row.sha256, row.size, outline)


def _seal(values: tuple[object, ...]) -> str:
    # repr distinguishes 1, 1.0 and "1", and gives a float to the bit.
    return hashlib.sha256(repr(values).encode("utf-8", "surrogatepass")).hexdigest()
