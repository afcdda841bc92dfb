"""The tables of the map store; at start they are created where there are none, and migrated by Alembic where older."""

from __future__ import annotations

import threading
from pathlib import Path

from sqlalchemy import (
    Boolean,
    Column,
    Connection,
    Engine,
    Float,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Table,
    false,
    inspect,
    text,
)

from .errors import StoreAwayError
from .failures import failures_as_store_errors

VERSION_TABLE = "linefix_schema"
VERSIONS = ("0001", "0002", "0003")  # of the migrations; the last is that of the tables below
BEFORE_ALEMBIC, NEWEST = VERSIONS[0], VERSIONS[-1]
_version_table = Table(VERSION_TABLE, MetaData(), Column("version_num", String(32), primary_key=True))  # as Alembic's
_ADVISORY_LOCK = 0x6C696E65666978  # "linefix"
# Alembic stores the subject of a migration in module globals.
_one_at_a_time = threading.Lock()

metadata = MetaData()

# Compared byte by byte whatever the database's collation, so that the order of a listing is one.
MAP_ID = String(128).with_variant(String(128, collation="C"), "postgresql")

# The properties of a map, short enough to be read before every search. A deleted map keeps its row, with an empty
# sha256: its next revision is a new number, so that an old ETag never matches a new map.
maps = Table(
    "maps",
    metadata,
    Column("map_id", MAP_ID, primary_key=True),
    Column("revision", Integer, nullable=False),
    Column("sha256", String(64), nullable=False),
    Column("segments", Integer, nullable=False),
    Column("min_x", Float, nullable=False),
    Column("min_y", Float, nullable=False),
    Column("max_x", Float, nullable=False),
    Column("max_y", Float, nullable=False),
    Column("sigma", Float, nullable=True),
    Column("oriented", Boolean, nullable=True),
    Column("seal", String(64), nullable=False, server_default=""),
    Column("quarantined", Boolean, nullable=False, server_default=false()),
)

# The content. Id and revision stand here a second time: they remain where damage hides a row of `maps`.
documents = Table(
    "map_documents",
    metadata,
    Column("map_id", MAP_ID, primary_key=True),
    Column("revision", Integer, nullable=False),
    Column("document", LargeBinary, nullable=False),
)


def upgrade(engine: Engine, writer: Engine) -> None:
    """Bring the tables to the newest version; does nothing, and writes nothing, where they have it.

    Workers that start together wait for the first of them: for SQLite's write lock, or for an advisory lock. All is one
    transaction, so that a migration that fails leaves what was there.

    Raises
    ------
    StoreError
        When the database does not take it, or was made by a newer version of the service.
    """
    with failures_as_store_errors(), engine.begin() as connection:
        if _version(connection) == NEWEST:
            return
    with _one_at_a_time, failures_as_store_errors(), writer.begin() as connection:
        if connection.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _ADVISORY_LOCK})
        version = _version(connection)
        if version == NEWEST:
            return
        if version is None and not inspect(connection).has_table(maps.name):
            _make(connection)
        else:
            _migrate(connection, version)


def _make(connection: Connection) -> None:
    metadata.create_all(connection)
    _version_table.create(connection, checkfirst=True)
    connection.execute(_version_table.insert().values(version_num=NEWEST))


def _migrate(connection: Connection, version: str | None) -> None:
    # Imported here: Alembic takes a tenth of each start, and hardly any start migrates.
    from alembic import command
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent / "migrations").replace("%", "%%"))
    config.attributes["connection"] = connection
    if version is None:
        command.stamp(config, BEFORE_ALEMBIC)
    command.upgrade(config, "head")


def _version(connection: Connection) -> str | None:
    found = inspect(connection).has_table(VERSION_TABLE)
    version = connection.execute(text(f"SELECT version_num FROM {VERSION_TABLE}")).scalar() if found else None
    if version is not None and version not in VERSIONS:
        raise StoreAwayError("the database was made by a newer version of the service; start that version")
    return version
