"""Looking the record of a map up, as before every use of an index."""

from __future__ import annotations

import os
import sqlite3
import time
from collections.abc import Iterator
from pathlib import Path

import psycopg
import pytest

from service.errors import BusyStoreError, UnknownMapError
from service.maps import MapStore
from service.maps import database as connections

from .stores import BOX, opened

# The connection that a map is looked up on, as the server knows it: that of a store with this process's name.
NAME = f"linefix_test_{os.getpid()}"
READS = f"application_name = '{NAME}' AND query LIKE '%quarantined%FROM maps%WHERE%map_id%'"


@pytest.fixture
def named(database: str) -> Iterator[MapStore]:
    """A store whose connections PostgreSQL can tell from others."""
    if database.startswith("sqlite"):
        pytest.skip("PostgreSQL only")
    with opened(f"{database}&application_name={NAME}") as store:
        store.put("m", b"{}", BOX)
        store.record("m")
        yield store


def asked(database: str, what: str) -> list[tuple[object, ...]]:
    """Return the rows of PostgreSQL about the connections that maps are looked up on."""
    with psycopg.connect(database, autocommit=True) as connection:
        return connection.execute(f"SELECT {what} FROM pg_stat_activity WHERE {READS}").fetchall()  # type: ignore[call-overload,no-any-return]


def test_what_another_does_is_seen_at_once(store: MapStore, database: str) -> None:
    """In a file without a wait; a server may take any time."""
    on_file = database.startswith("sqlite")
    with opened(database) as other:
        for revision in (1, 2, 3):
            other.put("m", b"{}", BOX)
            record = store.record("m")
            assert record.revision == revision
            assert store.record_at_once("m") == (record if on_file else None)
        other.put("m", b"{}", BOX)
        at_once = store.record_at_once("m")
        assert (at_once.revision if at_once else None) == (4 if on_file else None)
        other.delete("m")
        assert store.record_at_once("m") is None
        with pytest.raises(UnknownMapError):
            store.record("m")
        other.put("m", b"{}", BOX)
        assert store.record("m").revision == 5


@pytest.mark.usefixtures("named")
def test_it_leaves_no_transaction_open(database: str) -> None:
    """One that stays open keeps the server from cleaning up, and others from changing tables."""
    assert asked(database, "state") == [("idle",)]


def test_a_connection_that_is_lost_is_made_anew(named: MapStore, database: str) -> None:
    assert asked(database, "pg_terminate_backend(pid)") == [(True,)]
    for _ in range(2):
        assert named.record("m").revision == 1


@pytest.mark.parametrize("patience", [0.05, 5.0])
def test_a_writer_is_waited_for_and_at_once_it_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, patience: float
) -> None:
    monkeypatch.setattr(connections, "BUSY_SECONDS", patience)
    path = tmp_path / "maps.sqlite3"
    with opened(f"sqlite:///{path}") as store, sqlite3.connect(path) as writer:
        store.put("m", b"{}", BOX)
        record = store.record("m")
        assert store.record_at_once("m") == record
        writer.execute("BEGIN EXCLUSIVE")
        began = time.monotonic()
        assert store.record_at_once("m") is None
        assert time.monotonic() - began < 4.0  # the store waits for five
        if patience < 1.0:
            for call in (store.record, lambda name: store.put(name, b"one", BOX)):
                with pytest.raises(BusyStoreError):
                    call("m")
        writer.rollback()
        assert store.record_at_once("m") == store.record("m") == record
        assert store.put("m", b"one", BOX) == (2, False)
        path.rename(tmp_path / "away")
        assert store.record_at_once("m") is None
    writer.close()


def test_a_file_in_the_place_of_another_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "maps.sqlite3"
    with opened(f"sqlite:///{path}") as store:
        store.put("m", b"{}", BOX)
        assert store.record("m").revision == 1
        path.rename(tmp_path / "away")
        with opened(f"sqlite:///{path}") as another:
            for _ in range(3):
                another.put("m", b"{}", BOX)
        assert store.record("m").revision == 3
