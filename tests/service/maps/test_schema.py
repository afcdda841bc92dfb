"""The tables: made where there are none, refused where they are others."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
from sqlalchemy import inspect, text

from service.errors import CorruptMapError, StoreAwayError
from service.maps import MapStore

from .stores import BOX, engine_of, on_every, opened


def test_workers_that_start_together(database: str) -> None:
    program = (
        "import sys; from service.database_location import database_url; from service.maps import MapStore; "
        "store = MapStore(database_url(sys.argv[1])); sys.stdin.read(1); store.open(); store.close()"
    )
    workers = [
        subprocess.Popen([sys.executable, "-c", program, database], stdin=subprocess.PIPE, stderr=subprocess.PIPE)
        for _ in range(2)
    ]
    with ThreadPoolExecutor(len(workers)) as threads:
        errors = list(threads.map(lambda worker: worker.communicate(b"x", timeout=60)[1], workers))
    assert [worker.returncode for worker in workers] == [0] * len(workers), errors
    with opened(database) as store:
        assert store.put("m", b"one", BOX) == (1, True)


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


def test_a_program_of_another_name_s_tables_stay(database: str) -> None:
    with opened(database), engine_of(database) as engine, engine.begin() as connection:
        connection.execute(text("CREATE TABLE other (id INTEGER)"))
    with opened(database) as store:
        assert store.put("m", b"one", BOX) == (1, True)
