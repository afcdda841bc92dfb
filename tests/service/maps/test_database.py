"""The database of the maps: its tables, its file, and one that is full, read-only, damaged or away."""

from __future__ import annotations

import os
import stat
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, nullcontext
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import inspect, text

from service.app import create_app
from service.database_location import database_url
from service.errors import CorruptMapError, ReadOnlyStoreError, StoreAwayError, StoreFullError
from service.maps import MapStore
from service.settings import Settings

from .stores import BOX, alter, engine_of, on_every, opened


def test_workers_that_start_together(database: str) -> None:
    """The first caller makes the tables, by whatever call; they stay next to those of other programs."""
    with ExitStack() as stack, ThreadPoolExecutor(4) as threads:
        stores = [stack.enter_context(closing(MapStore(database_url(database)))) for _ in range(4)]
        together = threading.Barrier(len(stores))

        def first(store: MapStore) -> object:
            together.wait(10)
            return store.list(1, "") if store is stores[0] else store.put("m", b"one", BOX)[0]

        assert sorted(list(threads.map(first, stores))[1:]) == [1, 2, 3]  # type: ignore[type-var]
    with engine_of(database) as engine, engine.begin() as connection:
        connection.execute(text("CREATE TABLE other (id INTEGER)"))
    with opened(database) as store:
        assert store.put("m", b"one", BOX) == (4, False)


@pytest.mark.parametrize(
    ("change", "error"),
    [
        ("UPDATE linefix_schema SET version = 9999", StoreAwayError),
        ("DELETE FROM linefix_schema", StoreAwayError),
        ("DROP TABLE linefix_schema", StoreAwayError),
        ("ALTER TABLE linefix_schema RENAME COLUMN version TO version_num", StoreAwayError),
        ("ALTER TABLE maps RENAME COLUMN points TO dots", CorruptMapError),
        ("ALTER TABLE maps ADD COLUMN colour INTEGER", CorruptMapError),
        ("DROP TABLE map_documents", CorruptMapError),
    ],
)
def test_other_tables_are_refused_and_left_alone(database: str, change: str, error: type[Exception]) -> None:
    with opened(database) as store:
        store.put("m", b"one", BOX)
    with engine_of(database) as engine:
        with engine.begin() as connection:
            connection.execute(text(change))
            tables = set(inspect(connection).get_table_names())
        with pytest.raises(error, match=r"another version|damaged"), opened(database):
            pass
        assert set(inspect(engine).get_table_names()) == tables


def test_an_up_to_date_database_is_only_read(store: MapStore) -> None:
    statements: list[str] = []

    def remember(connection: object, cursor: object, statement: str, *_: object) -> None:
        statements.append(statement)

    with on_every("before_cursor_execute", remember):
        store.open()
    assert statements
    assert all(statement.startswith(("SELECT", "PRAGMA")) for statement in statements)


def test_it_is_for_its_owner_alone(tmp_path: Path) -> None:
    before = os.umask(0o022)
    try:
        with opened(f"sqlite:///{tmp_path / 'data' / 'maps.sqlite3'}") as store:
            store.put("m", b"{}", BOX)
    finally:
        os.umask(before)
    for path in (tmp_path / "data", *(tmp_path / "data").iterdir()):
        assert stat.S_IMODE(path.stat().st_mode) & 0o077 == 0, path


def test_who_stands_in_for_another_makes_none(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'maps.sqlite3'}"
    for there in (False, True):
        missed = nullcontext() if there else pytest.raises(StoreAwayError)
        with closing(MapStore(database_url(url), may_make=False)) as store, missed:
            store.open()
        assert (tmp_path / "maps.sqlite3").exists() is there
        with opened(url):
            pass


def test_none_of_several_workers_makes_it(tmp_path: Path) -> None:
    """A process that was still starting when the file was moved created it again."""
    services = create_app(Settings(data_dir=tmp_path, workers=2, searches=2)).state.services
    with pytest.raises(StoreAwayError):
        services.store.open()
    assert list(tmp_path.iterdir()) == []
    services.close()


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
