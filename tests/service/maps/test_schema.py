"""The tables: made where there are none, refused where they are others."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing

import pytest
from sqlalchemy import inspect, text

from service.database_location import database_url
from service.errors import CorruptMapError, StoreAwayError
from service.maps import MapStore

from .stores import BOX, engine_of, on_every, opened


def test_workers_that_start_together(database: str) -> None:
    """Whoever comes first makes the tables, by whatever call; they stay next to those of other programs."""
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
