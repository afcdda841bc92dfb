"""The tables' version, and their migration at start by Alembic."""

from __future__ import annotations

import threading
from functools import cache
from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.script import ScriptDirectory
from sqlalchemy import Connection, Engine, inspect, text

from .errors import StoreAwayError
from .failures import failures_as_store_errors
from .tables import maps

VERSION_TABLE = "linefix_schema"
BEFORE_ALEMBIC = "0001"
_ADVISORY_LOCK = 0x6C696E65666978  # "linefix"
# Alembic keeps what it migrates in module globals.
_one_at_a_time = threading.Lock()


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
        if _version(connection) == _head():
            return
    with _one_at_a_time, failures_as_store_errors(), writer.begin() as connection:
        if connection.dialect.name == "postgresql":
            connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _ADVISORY_LOCK})
        version = _version(connection)
        if version == _head():
            return
        config = _config()
        config.attributes["connection"] = connection
        if version is None and inspect(connection).has_table(maps.name):
            command.stamp(config, BEFORE_ALEMBIC)
        command.upgrade(config, "head")


def _version(connection: Connection) -> str | None:
    # Not through Alembic, which writes two lines to the log whenever it looks.
    found = inspect(connection).has_table(VERSION_TABLE)
    version = connection.execute(text(f"SELECT version_num FROM {VERSION_TABLE}")).scalar() if found else None
    if version is not None and version not in _known():
        raise StoreAwayError("the database was made by a newer version of the service")
    return version


def _config() -> Config:
    config = Config()
    config.set_main_option("script_location", str(Path(__file__).parent / "migrations").replace("%", "%%"))
    return config


@cache
def _known() -> frozenset[str]:
    return frozenset(script.revision for script in ScriptDirectory.from_config(_config()).walk_revisions())


@cache
def _head() -> str | None:
    return ScriptDirectory.from_config(_config()).get_current_head()
