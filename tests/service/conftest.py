"""Databases to keep maps in: SQLite, and PostgreSQL where one answers."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psycopg
import pytest

from service.database_location import database_url
from service.maps import MapStore

from .maps.stores import Lookup

SERVER = "LINEFIX_TEST_POSTGRESQL"
LOCAL = "postgresql://postgres@127.0.0.1:5432/test"


KINDS = ("sqlite", "postgresql")


@contextmanager
def empty_database(kind: str, folder: Path) -> Iterator[str]:
    """Give the URL of an empty database; on PostgreSQL a schema of its own that is dropped afterwards.

    The server is that of ``LINEFIX_TEST_POSTGRESQL``, which then has to answer, else a local one if there is any.
    """
    if kind == "sqlite":
        yield f"sqlite:///{folder / 'maps.sqlite3'}"
        return
    server = os.environ.get(SERVER, LOCAL)
    try:
        connection = psycopg.connect(server, autocommit=True, connect_timeout=3)
    except psycopg.OperationalError:
        if SERVER in os.environ:
            raise
        pytest.skip("no PostgreSQL answers")
    schema = f"linefix_test_{secrets.token_hex(6)}"
    with connection:
        connection.execute(f"CREATE SCHEMA {schema}")  # type: ignore[call-overload]
        try:
            yield f"{server}?options=-csearch_path%3D{schema}"
        finally:
            connection.execute(f"DROP SCHEMA {schema} CASCADE")  # type: ignore[call-overload]
    connection.close()


@pytest.fixture(params=KINDS)
def database(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """The URL of an empty database of each kind."""
    with empty_database(request.param, tmp_path) as url:
        yield url


@pytest.fixture
def store(database: str) -> Iterator[MapStore]:
    opened = MapStore(database_url(database))
    opened.open()
    yield opened
    opened.close()


@pytest.fixture
def lookup(tmp_path: Path) -> Iterator[Lookup]:
    made = Lookup(tmp_path)
    yield made
    made.parser.close()
    made.store.close()
