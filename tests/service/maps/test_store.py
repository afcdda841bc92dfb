"""The map store alone, on each database that it can use, and the record of a map before every use of an index."""

from __future__ import annotations

import os
import re
import sqlite3
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import psycopg
import pytest

from service.errors import BusyStoreError, CorruptMapError, ReadOnlyStoreError, StoreFullError, UnknownMapError
from service.maps import MapOutline, MapRecord, MapStore, Preconditions
from service.maps import database as connections
from service.maps.store import ANY, logger
from service.maps.tables import row_of

from .stores import BOX, alter, opened


def test_a_map_lives_through_its_revisions(store: MapStore) -> None:
    """Its outline is known without reading it, and the maps next to it are left alone."""
    outlines = [
        MapOutline(4, 2, (-1.0, 0.1, 1e5, 1 / 3), sigma, oriented)
        for sigma, oriented in ((None, None), (0.0, False), (1 / 3, True), (-0.0, None))
    ]
    for name in ("l", "n"):
        assert store.put(name, name.encode(), BOX) == (1, True)
    for number, outline in enumerate(outlines, 1):
        assert store.put("m", b"%d" % number, outline) == (number, number == 1)
        record = store.record("m")
        assert record == store.load("m").record == MapRecord("m", number, record.sha256, 1, outline)
        assert (store.load("m").document, record.oriented) == (b"%d" % number, outline.oriented)
        assert store.list(10, "").maps == [store.record("l"), record, store.record("n")]
    store.delete("m")
    for call in (store.record, store.load, store.delete):
        with pytest.raises(UnknownMapError):
            call("m")
    assert [(one.map_id, one.revision) for one in store.list(10, "").maps] == [("l", 1), ("n", 1)]
    assert [store.load(name).document for name in ("l", "n")] == [b"l", b"n"]
    assert store.put("m", b"anew", BOX) == (5, True)


def test_a_directory_is_made_where_there_is_none(tmp_path: Path) -> None:
    with opened(f"sqlite:///{tmp_path / 'a' / 'b' / 'maps.sqlite3'}") as store:
        store.put("m", b"one", BOX)
    (tmp_path / "file").touch()
    with pytest.raises(ReadOnlyStoreError, match="folder"), opened(f"sqlite:///{tmp_path / 'file' / 'maps'}"):
        pass


def test_a_listing_is_in_the_order_of_bytes(store: MapStore) -> None:
    names = ["b", "hq", "hq-", "hq-1", "hq-2", "hq-zz", "hq.1", "hr", "HQ-1"]
    for name in names:
        store.put(name, b"x", BOX)
    pages, after = [], ""
    while after is not None:
        page = store.list(3, after)
        pages.append([item.map_id for item in page.maps])
        after = page.next
    # A page that is full is the last all the same, when nothing follows.
    assert pages == [sorted(names)[k : k + 3] for k in (0, 3, 6)]
    for most, after, found in ((9, "", ["hq-", "hq-1", "hq-2", "hq-zz"]), (2, "hq-", ["hq-1", "hq-2"]), (9, "hr", [])):
        assert [item.map_id for item in store.list(most, after, "hq-").maps] == found


def test_of_many_first_writers_none_is_lost(database: str) -> None:
    with opened(database) as one, opened(database) as other, ThreadPoolExecutor(12) as threads:
        asked = [threads.submit((one, other)[i % 2].put, "m", b"%d" % i, BOX) for i in range(24)]
        answers = [each.result() for each in asked]
        assert sorted(revision for revision, _ in answers) == list(range(1, 25))
        assert [created for _, created in answers].count(True) == 1
        last = max(range(24), key=lambda i: answers[i][0])
        assert one.load("m").document == b"%d" % last


COUNTS_AND_BOUNDS = ("segments", "points", "size", "min_x", "min_y", "max_x", "max_y")


@pytest.mark.parametrize(
    ("column", "value"),
    [("revision", 7), *((name, "0" * 64) for name in ("sha256", "seal")), *((name, 5) for name in COUNTS_AND_BOUNDS)],
)
def test_a_changed_row_is_named_and_not_used(store: MapStore, database: str, column: str, value: object) -> None:
    for name in ("before", "m", "next"):
        store.put(name, b"one", BOX)
    alter(database, f"UPDATE maps SET {column} = :value WHERE map_id = 'm'", value=value)
    for call in (store.record, store.load):
        with pytest.raises(CorruptMapError):
            call("m")
    page = store.list(10, "")
    assert ([item.map_id for item in page.maps], page.corrupt) == (["before", "next"], ["m"])
    revision, created = store.put("m", b"again", BOX)
    # Above every number that the row or the document may have had.
    assert (created, revision) == (False, 8 if column == "revision" else 2)
    assert store.load("m").document == b"again"
    assert store.list(10, "").corrupt == []


def test_a_deletion_that_was_tampered_with_is_damage(store: MapStore, database: str) -> None:
    store.put("m", b"one", BOX)
    alter(database, "UPDATE maps SET sha256 = '' WHERE map_id = 'm'")
    with pytest.raises(CorruptMapError):
        store.record("m")
    store.delete("m")  # what is damaged can be deleted
    with pytest.raises(UnknownMapError):
        store.load("m")


def test_a_changed_document_is_quarantined_for_all(database: str) -> None:
    with opened(database) as one, opened(database) as other:
        for name in ("m", "n"):
            one.put(name, b"one", BOX)
        alter(database, "UPDATE map_documents SET document = :value WHERE map_id = 'm'", value=b"two")
        # Not looked at yet, so not known yet: what is cached of it is still the right map.
        assert other.record("m").revision == 1
        with pytest.raises(CorruptMapError):
            one.load("m")
        with pytest.raises(CorruptMapError):
            other.record("m")
        assert ([item.map_id for item in other.list(10, "").maps], other.list(10, "").corrupt) == (["n"], ["m"])
        # Even where the bytes come right again by themselves, as after a bad cable.
        alter(database, "UPDATE map_documents SET document = :value WHERE map_id = 'm'", value=b"one")
        with pytest.raises(CorruptMapError):
            other.load("m")
        assert other.put("m", b"three", BOX, Preconditions(if_match=frozenset([1]))) == (2, False)
        assert one.load("m").document == b"three"


def test_only_the_revision_that_is_damaged_is_quarantined(database: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another worker puts the map again after this one has seen the damage: that revision is whole."""
    with opened(database) as one, opened(database) as other:
        one.put("m", b"one", BOX)
        alter(database, "UPDATE map_documents SET document = :value WHERE map_id = 'm'", value=b"two")
        monkeypatch.setattr(logger, "error", lambda *_, **__: other.put("m", b"three", BOX))  # before it is marked
        with pytest.raises(CorruptMapError):
            one.load("m")
        for store in (one, other):
            assert (store.load("m").document, store.record("m").revision) == (b"three", 2)


@pytest.mark.parametrize("table", ["maps", "map_documents"])
def test_a_lost_row_is_named(store: MapStore, database: str, table: str) -> None:
    store.put("m", b"one", BOX)
    store.put("m", b"two", BOX)
    alter(database, f"UPDATE {table} SET map_id = :value WHERE map_id = 'm'", value="n")
    for name in ("m", "n") if table == "maps" else ("m",):
        for call in (store.load, store.record) if table == "maps" else (store.load,):
            with pytest.raises(CorruptMapError):
                call(name)
    assert store.put("m", b"three", BOX) == (3, False)
    assert store.load("m").document == b"three"


def test_a_map_that_was_put_a_thousand_times(store: MapStore, database: str) -> None:
    """Its revision is looked at as a number, whichever object holds it."""
    store.put("m", b"one", BOX)
    row = row_of(replace(store.record("m"), revision=1000))
    alter(database, "UPDATE maps SET revision = 1000, seal = :seal WHERE map_id = 'm'", seal=row["seal"])
    alter(database, "UPDATE map_documents SET revision = 1000 WHERE map_id = 'm'")
    assert store.load("m").record.revision == 1000
    assert store.put("m", b"two", BOX, Preconditions(if_match=frozenset([1000]))) == (1001, False)


# Bytes that are put under an id, and whether they fit; "-" deletes. Ids take room, too, also of maps that are gone.
ROOM = {
    "of all maps": (10_000, "a9501! a9500 a5000 b5000! b3000 a6000 a6001! a- b9000 c0! d0! b9001!"),
    "of one prefix, half": (
        20_000, "hq-a5000 hq-b4001! hq-b4000 hq-a5000 hq-c0! hq-a5001! lab-a9000 hq-b- " "hq-d0 hq-d- hq-e0 hq-e- "
        "hq-f0 hq-f- hq-g0 hq-g- hq-h0 hq-h- hq-i0 hq-i- hq-j0 hq-j- hq-k0 hq-k- hq-more1!"),
}  # fmt: skip


@pytest.mark.parametrize("kind", ROOM)
def test_maps_take_no_more_than_they_may(database: str, kind: str) -> None:
    """Class of attack: what is shared by all is filled by one."""
    most, steps = ROOM[kind]
    with opened(database, most) as store:
        for step in steps.split():
            name, size, refused = re.fullmatch(r"(.*?)(\d+|-)(!?)", step).groups()  # type: ignore[union-attr]
            prefix = name.partition("-")[0] + "-" if "-" in name else ""
            if size == "-":
                store.delete(name)
            elif refused:
                with pytest.raises(StoreFullError, match=r"[12]0000 bytes"):
                    store.put(name, bytes(int(size)), BOX, ANY, prefix)
            else:
                store.put(name, bytes(int(size)), BOX, ANY, prefix)
                assert len(store.load(name).document) == int(size)


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
