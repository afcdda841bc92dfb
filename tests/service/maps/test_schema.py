"""The tables' migration at start."""

from __future__ import annotations

import hashlib
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.migration import MigrationContext
from alembic.script import ScriptDirectory
from sqlalchemy import Column, Engine, Float, Integer, LargeBinary, MetaData, String, Table, event, inspect, text

from service.database_location import database_url
from service.maps import MapOutline, MapStore, Preconditions, schema
from service.maps.database import open_engine
from service.maps.errors import CorruptMapError, StoreAwayError, UnknownMapError
from service.maps.schema import metadata

BOX = MapOutline(4, (0.0, 0.0, 1.0, 1.0))
ROUGH = b'{"segments":[[0,0,1,0]],"sigma":0.07}'
# As `create_all` made it before there were migrations.
OLD = Table(
    "maps",
    MetaData(),
    Column("map_id", String(128), primary_key=True),
    Column("revision", Integer, nullable=False),
    Column("document", LargeBinary, nullable=True),
    Column("sha256", String(64), nullable=False),
    Column("segments", Integer, nullable=False),
    *(Column(name, Float, nullable=False) for name in ("min_x", "min_y", "max_x", "max_y")),
)


def an_old_row(map_id: str, revision: int, document: bytes | None, sha256: str) -> dict[str, object]:
    box = {"min_x": -0.5, "min_y": 1 / 3, "max_x": 1e5, "max_y": 2.0}
    return {"map_id": map_id, "revision": revision, "document": document, "sha256": sha256, "segments": 4} | box


def make_old(database: str) -> None:
    url = database_url(database)
    if url.get_backend_name() == "sqlite":
        Path(url.database or "").touch()  # an engine never makes the file
    engine = open_engine(url)
    with engine.begin() as connection:
        OLD.create(connection)
        for row in (
            an_old_row("kept", 3, b"document", hashlib.sha256(b"document").hexdigest()),
            an_old_row("damaged", 2, b"document", hashlib.sha256(b"another").hexdigest()),
            an_old_row("deleted", 5, None, ""),
            an_old_row("rough", 1, ROUGH, hashlib.sha256(ROUGH).hexdigest()),
        ):
            connection.execute(OLD.insert().values(**row))
    engine.dispose()


def check_migrated(store: MapStore) -> None:
    kept = store.load("kept")
    assert (kept.record.revision, kept.document) == (3, b"document")
    assert [item.outline.bounds for item in store.list(10, "").maps if item.map_id == "kept"] == [
        (-0.5, 1 / 3, 1e5, 2.0)
    ]
    told = {item.map_id: (item.outline.sigma, item.outline.oriented) for item in store.list(10, "").maps}
    assert told == {"damaged": (None, None), "kept": (None, None), "rough": (0.07, None)}
    for name, error in (("damaged", CorruptMapError), ("deleted", UnknownMapError)):
        with pytest.raises(error):
            store.load(name)
    assert store.put("deleted", b"new", BOX, Preconditions()) == (6, True)


def differences(database: str) -> list[object]:
    """Return in what the tables differ from those that the store uses."""
    options = {"version_table": schema.VERSION_TABLE, "compare_type": True}
    engine = open_engine(database_url(database))
    try:
        with engine.connect() as connection:
            return list(compare_metadata(MigrationContext.configure(connection, opts=options), metadata))
    finally:
        engine.dispose()


@pytest.mark.usefixtures("store")
def test_new_tables_are_those_that_are_used(database: str) -> None:
    assert differences(database) == []


@pytest.mark.usefixtures("store")
def test_of_new_tables_alembic_knows_the_version(database: str) -> None:
    engine = open_engine(database_url(database))
    with engine.connect() as connection:
        migrations = MigrationContext.configure(connection, opts={"version_table": schema.VERSION_TABLE})
        assert migrations.get_current_revision() == schema.NEWEST
    engine.dispose()


def test_the_versions_are_those_of_the_migrations() -> None:
    scripts = ScriptDirectory(str(Path(schema.__file__).parent / "migrations")).walk_revisions()
    assert tuple(script.revision for script in scripts)[::-1] == schema.VERSIONS


def test_a_database_from_before_migrations(database: str) -> None:
    make_old(database)
    store = MapStore(database_url(database))
    store.open()
    check_migrated(store)
    store.close()
    assert differences(database) == []


@pytest.mark.parametrize("old", [False, True], ids=["empty", "old"])
def test_workers_that_start_together(database: str, old: bool) -> None:
    if old:
        make_old(database)
    program = (
        "import sys; from service.database_location import database_url; from service.maps import MapStore; "
        "store = MapStore(database_url(sys.argv[1])); sys.stdin.read(1); store.open(); store.close()"
    )
    workers = [
        subprocess.Popen([sys.executable, "-c", program, database], stdin=subprocess.PIPE, stderr=subprocess.PIPE)
        for _ in range(4)
    ]
    with ThreadPoolExecutor(len(workers)) as threads:
        errors = list(threads.map(lambda worker: worker.communicate(b"x", timeout=60)[1], workers))
    assert [worker.returncode for worker in workers] == [0] * len(workers), errors
    store = MapStore(database_url(database))
    store.open()
    if old:
        check_migrated(store)
    store.close()


def test_a_migration_that_fails_leaves_what_was_there(database: str, monkeypatch: pytest.MonkeyPatch) -> None:
    make_old(database)
    store = MapStore(database_url(database))

    def fail(*_: object) -> None:
        raise RuntimeError("the power is gone")

    with monkeypatch.context() as broken:
        broken.setattr("alembic.op.add_column", fail)
        with pytest.raises(RuntimeError):
            store.open()
    engine = open_engine(database_url(database))
    with engine.connect() as connection:
        assert set(inspect(connection).get_table_names()) == {"maps"}
        assert connection.execute(text("SELECT document FROM maps WHERE map_id = 'kept'")).scalar() == b"document"
    engine.dispose()
    store.open()
    check_migrated(store)
    store.close()


@pytest.mark.usefixtures("store")
def test_a_newer_database_is_refused_and_left_alone(database: str) -> None:
    engine = open_engine(database_url(database))
    with engine.begin() as connection:
        connection.execute(text(f"UPDATE {schema.VERSION_TABLE} SET version_num = '9999'"))
    engine.dispose()
    other = MapStore(database_url(database))
    with pytest.raises(StoreAwayError, match="newer"):
        other.open()
    other.close()


def test_an_up_to_date_database_is_only_read(store: MapStore) -> None:
    statements: list[str] = []

    def remember(connection: object, cursor: object, statement: str, *_: object) -> None:
        statements.append(statement)

    event.listen(Engine, "before_cursor_execute", remember)
    try:
        store.open()
    finally:
        event.remove(Engine, "before_cursor_execute", remember)
    assert statements
    assert all(statement.startswith(("SELECT", "BEGIN", "PRAGMA")) for statement in statements)
    assert "BEGIN IMMEDIATE" not in statements
