"""Looking the record of a map up, as before every use of an index."""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path

import psycopg
import pytest

from service.database_location import database_url
from service.errors import BusyStoreError, UnknownMapError
from service.maps import MapStore
from service.maps import database as connections

from .stores import BOX

# Another process runs commands, line by line, on the same database.
OTHER = """
import sys
from service.database_location import database_url
from service.maps import MapOutline, MapStore
store = MapStore(database_url(sys.argv[1]))
for line in sys.stdin:
    if line.strip() == "put":
        store.put("m", b"{}", MapOutline(4, 0, (0.0, 0.0, 1.0, 1.0)))
    else:
        store.delete("m")
    print("done", flush=True)
store.close()
"""


# The connection that a map is looked up on, as the server knows it: that of a store with this process's name.
NAME = f"linefix_test_{os.getpid()}"
READS = f"application_name = '{NAME}' AND query LIKE '%quarantined%FROM maps%WHERE%map_id%'"


class Other:
    """A second process on the database."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self._process = process

    def does(self, what: str) -> None:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        print(what, file=self._process.stdin, flush=True)
        assert self._process.stdout.readline() == "done\n"


@pytest.fixture
def other(database: str) -> Iterator[Other]:
    command = [sys.executable, "-c", OTHER, database]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        yield Other(process)


@pytest.fixture
def named(database: str) -> Iterator[MapStore]:
    """A store whose connections PostgreSQL can tell from others."""
    if database.startswith("sqlite"):
        pytest.skip("PostgreSQL only")
    with closing(MapStore(database_url(f"{database}&application_name={NAME}"))) as store:
        store.put("m", b"{}", BOX)
        store.record("m")
        yield store


def test_what_another_process_does_is_seen_at_once(store: MapStore, other: Other) -> None:
    for revision in (1, 2, 3):
        other.does("put")
        assert store.record("m").revision == revision
    other.does("delete")
    with pytest.raises(UnknownMapError):
        store.record("m")
    other.does("put")
    assert store.record("m").revision == 4


@pytest.mark.usefixtures("named")
def test_it_leaves_no_transaction_open(database: str) -> None:
    """One that stays open keeps the server from cleaning up, and others from changing tables."""
    with psycopg.connect(database, autocommit=True) as connection:
        states = connection.execute(f"SELECT state FROM pg_stat_activity WHERE {READS}").fetchall()
    assert states == [("idle",)]


def test_threads_do_not_wait_for_each_other(store: MapStore) -> None:
    store.put("m", b"{}", BOX)
    with ThreadPoolExecutor(8) as threads:
        found = list(threads.map(store.record, ["m"] * 400))
    assert {record.revision for record in found} == {1}


def test_a_connection_that_is_lost_is_made_anew(named: MapStore, database: str) -> None:
    with psycopg.connect(database, autocommit=True) as connection:
        ended = connection.execute(f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE {READS}").fetchall()
    assert ended == [(True,)]
    for _ in range(2):
        assert named.record("m").revision == 1


def test_it_waits_for_a_writer_as_the_store_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(connections, "BUSY_SECONDS", 0.05)
    path = tmp_path / "maps.sqlite3"
    with closing(MapStore(database_url(f"sqlite:///{path}"))) as store, closing(sqlite3.connect(path)) as writer:
        store.put("m", b"{}", BOX)
        assert store.record("m").revision == 1
        writer.execute("BEGIN EXCLUSIVE")
        with pytest.raises(BusyStoreError):
            store.record("m")
        writer.rollback()
        assert store.record("m").revision == 1


def test_a_file_is_asked_at_once_and_a_server_is_not(store: MapStore, other: Other, database: str) -> None:
    on_file = database.startswith("sqlite")
    for revision in (1, 2, 3):
        other.does("put")
        record = store.record("m")
        assert record.revision == revision
        assert store.record_at_once("m") == (record if on_file else None)
    other.does("put")
    at_once = store.record_at_once("m")
    assert (at_once.revision if at_once else None) == (4 if on_file else None)
    other.does("delete")
    assert store.record_at_once("m") is None


def test_at_once_no_writer_is_waited_for(tmp_path: Path) -> None:
    path = tmp_path / "maps.sqlite3"
    with closing(MapStore(database_url(f"sqlite:///{path}"))) as store, closing(sqlite3.connect(path)) as writer:
        store.put("m", b"{}", BOX)
        record = store.record("m")
        assert store.record_at_once("m") == record
        writer.execute("BEGIN EXCLUSIVE")
        began = time.monotonic()
        assert store.record_at_once("m") is None
        assert time.monotonic() - began < 4.0  # the store waits for five
        writer.rollback()
        assert store.record_at_once("m") == record
        path.rename(tmp_path / "away")
        assert store.record_at_once("m") is None


def test_a_file_in_the_place_of_another_is_noticed(tmp_path: Path) -> None:
    path = tmp_path / "maps.sqlite3"
    with closing(MapStore(database_url(f"sqlite:///{path}"))) as store:
        store.put("m", b"{}", BOX)
        assert store.record("m").revision == 1
        path.rename(tmp_path / "away")
        with closing(MapStore(database_url(f"sqlite:///{path}"))) as another:
            for _ in range(3):
                another.put("m", b"{}", BOX)
        assert store.record("m").revision == 3
