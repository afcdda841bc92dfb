"""The map store with a full, read-only, busy, broken or absent database."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from service.errors import (
    CorruptMapError,
    ReadOnlyStoreError,
    StoreAwayError,
    StoreFullError,
)

from .stores import BOX, alter, engine_of, on_every, opened


def test_a_full_store_leaves_what_was_there(tmp_path: Path) -> None:
    def fill(connection: Any, _: object) -> None:
        connection.execute("PRAGMA max_page_count=12")

    with on_every("connect", fill), opened(f"sqlite:///{tmp_path / 'maps.sqlite3'}") as store:
        store.put("m", b"before", BOX)
        with pytest.raises(StoreFullError):
            store.put("m", b"x" * 1_000_000, BOX)
        assert store.load("m").document == b"before"


TRIGGERS = {
    "a document that comes back otherwise": "spoils AFTER UPDATE ON map_documents "
    "BEGIN UPDATE map_documents SET document = x'00'; END",
    # Once it may be that another worker was first, twice it is not.
    "a table that takes no row": "refuses BEFORE UPDATE ON maps BEGIN SELECT RAISE(ABORT, 'never'); END",
}


@pytest.mark.parametrize("kind", TRIGGERS)
def test_what_the_database_does_not_keep_is_not_committed(tmp_path: Path, kind: str) -> None:
    url = f"sqlite:///{tmp_path / 'maps.sqlite3'}"
    with opened(url) as store:
        store.put("m", b"one", BOX)
        with engine_of(url) as engine, engine.begin() as connection:
            connection.exec_driver_sql(f"CREATE TRIGGER {TRIGGERS[kind]}")
        with pytest.raises(CorruptMapError):
            store.put("m", b"two", BOX)
        assert (store.load("m").document, store.record("m").revision) == (b"one", 1)


def test_a_read_only_store_still_reads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "maps.sqlite3"
    url = f"sqlite:///{path}"
    with opened(url) as writable:
        writable.put("m", b"before", BOX)
        writable.put("damaged", b"before", BOX)
        alter(url, "UPDATE map_documents SET document = :value WHERE map_id = 'damaged'", value=b"after")
    monkeypatch.chdir(tmp_path)
    with opened(f"sqlite:///file:{path}?mode=ro&uri=true") as store:
        with pytest.raises(ReadOnlyStoreError):
            store.put("m", b"after", BOX)
        with pytest.raises(ReadOnlyStoreError):
            store.delete("m")
        assert store.load("m").document == b"before"
        with pytest.raises(CorruptMapError):
            store.load("damaged")
    assert {item.name for item in tmp_path.iterdir()} == {"maps.sqlite3", "maps.sqlite3-reserve"}


def test_a_postgresql_that_takes_no_writes(database: str) -> None:
    if database.startswith("sqlite"):
        pytest.skip("PostgreSQL only")
    with opened(database) as store:
        store.put("m", b"before", BOX)
    with opened(database + "%20-cdefault_transaction_read_only%3Don") as store:
        with pytest.raises(ReadOnlyStoreError):
            store.put("m", b"after", BOX)
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


def test_a_database_that_is_none_or_away(tmp_path: Path) -> None:
    (tmp_path / "maps.sqlite3").write_bytes(b"this is no database at all" * 100)
    with pytest.raises(CorruptMapError), opened(f"sqlite:///{tmp_path / 'maps.sqlite3'}"):
        pass
    with pytest.raises(StoreAwayError), opened("postgresql://nobody@127.0.0.1:9/none"):
        pass
