"""The map store with a full, read-only, busy, broken or absent database."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from service.errors import (
    BusyStoreError,
    CorruptMapError,
    ReadOnlyStoreError,
    StoreAwayError,
    StoreFullError,
)
from service.maps import database as connections

from .stores import ANY, BOX, alter, engine_of, on_every, opened


def test_a_full_store_leaves_what_was_there(tmp_path: Path) -> None:
    def fill(connection: Any, _: object) -> None:
        connection.execute("PRAGMA max_page_count=12")

    with on_every("connect", fill), opened(f"sqlite:///{tmp_path / 'maps.sqlite3'}") as store:
        store.put("m", b"before", BOX, ANY)
        with pytest.raises(StoreFullError):
            store.put("m", b"x" * 1_000_000, BOX, ANY)
        assert store.load("m").document == b"before"


def test_what_comes_back_otherwise_than_written_is_not_committed(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'maps.sqlite3'}"
    with opened(url) as store:
        store.put("m", b"one", BOX, ANY)
        with engine_of(url) as engine, engine.begin() as connection:
            connection.exec_driver_sql(
                "CREATE TRIGGER spoils AFTER UPDATE ON map_documents "
                "BEGIN UPDATE map_documents SET document = x'00'; END"
            )
        with pytest.raises(CorruptMapError):
            store.put("m", b"two", BOX, ANY)
        assert (store.load("m").document, store.record("m").revision) == (b"one", 1)


def test_a_table_that_takes_no_row_is_damaged(tmp_path: Path) -> None:
    """Once it may be that another worker was first, twice it is not."""
    url = f"sqlite:///{tmp_path / 'maps.sqlite3'}"
    with opened(url) as store:
        with engine_of(url) as engine, engine.begin() as connection:
            connection.exec_driver_sql(
                "CREATE TRIGGER refuses BEFORE INSERT ON maps BEGIN SELECT RAISE(ABORT, 'never'); END"
            )
        with pytest.raises(CorruptMapError):
            store.put("m", b"one", BOX, ANY)


def test_a_read_only_store_still_reads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "maps.sqlite3"
    url = f"sqlite:///{path}"
    with opened(url) as writable:
        writable.put("m", b"before", BOX, ANY)
        writable.put("damaged", b"before", BOX, ANY)
        alter(url, "UPDATE map_documents SET document = :value WHERE map_id = 'damaged'", value=b"after")
    monkeypatch.chdir(tmp_path)
    with opened(f"sqlite:///file:{path}?mode=ro&uri=true") as store:
        with pytest.raises(ReadOnlyStoreError):
            store.put("m", b"after", BOX, ANY)
        with pytest.raises(ReadOnlyStoreError):
            store.delete("m", ANY)
        assert store.load("m").document == b"before"
        with pytest.raises(CorruptMapError):
            store.load("damaged")
    assert {item.name for item in tmp_path.iterdir()} == {"maps.sqlite3", "maps.sqlite3-reserve"}


def test_a_postgresql_that_takes_no_writes(database: str) -> None:
    if database.startswith("sqlite"):
        pytest.skip("PostgreSQL only")
    with opened(database) as store:
        store.put("m", b"before", BOX, ANY)
    with opened(database + "%20-cdefault_transaction_read_only%3Don") as store:
        with pytest.raises(ReadOnlyStoreError):
            store.put("m", b"after", BOX, ANY)
        assert store.load("m").document == b"before"


def test_commits_wait_for_the_disk(database: str) -> None:
    def said(url: str, *questions: str) -> list[object]:
        with engine_of(url) as engine, engine.connect() as connection:
            return [connection.exec_driver_sql(question).scalar() for question in questions]

    if database.startswith("sqlite"):
        with opened(database):
            pass
        assert said(database, "PRAGMA journal_mode", "PRAGMA synchronous") == ["delete", 3]
        return
    assert said(database + "%20-csynchronous_commit%3Doff", "SHOW synchronous_commit") == ["on"]
    assert said(database + "%20-csynchronous_commit%3Dremote_apply", "SHOW synchronous_commit") == ["remote_apply"]


def test_a_database_that_is_none(tmp_path: Path) -> None:
    (tmp_path / "maps.sqlite3").write_bytes(b"this is no database at all" * 100)
    with pytest.raises(CorruptMapError), opened(f"sqlite:///{tmp_path / 'maps.sqlite3'}"):
        pass


def test_a_database_that_is_away() -> None:
    with pytest.raises(StoreAwayError), opened("postgresql://nobody@127.0.0.1:9/none"):
        pass


def test_a_busy_database_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "BUSY_SECONDS", 0.05)
    path = tmp_path / "maps.sqlite3"
    with opened(f"sqlite:///{path}") as store, closing(sqlite3.connect(path)) as other:
        other.execute("BEGIN IMMEDIATE")
        with pytest.raises(BusyStoreError):
            store.put("m", b"one", BOX, ANY)
        other.rollback()
        assert store.put("m", b"one", BOX, ANY) == (1, True)
