"""The map store alone, on each database that it can use."""

from __future__ import annotations

import logging
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest

from service.database_location import database_url
from service.errors import (
    CorruptMapError,
    ReadOnlyStoreError,
    RevisionConflictError,
    StoreFullError,
    UnknownMapError,
)
from service.maps import EVERY_REVISION, MapOutline, MapRecord, MapStore, Preconditions
from service.maps.tables import row_of

from .stores import ANY, BOX, alter, opened


def test_a_map_lives_through_its_revisions(store: MapStore) -> None:
    assert store.put("m", b"one", BOX, ANY) == (1, True)
    assert store.put("m", b"two", MapOutline(5, 3, (-1.0, 0.1, 1e5, 1 / 3)), ANY) == (2, False)
    assert store.load("m").document == b"two"
    told = MapOutline(5, 3, (-1.0, 0.1, 1e5, 1 / 3))
    assert store.record("m") == store.load("m").record == MapRecord("m", 2, store.record("m").sha256, 3, told)
    page = store.list(10, "")
    assert page.maps == [store.record("m")]
    store.delete("m", ANY)
    for call in (store.record, store.load, lambda name: store.delete(name, ANY)):
        with pytest.raises(UnknownMapError):
            call("m")
    assert store.list(10, "").maps == []
    assert store.put("m", b"three", BOX, ANY) == (3, True)


def test_a_map_s_properties_are_told_without_reading_it(store: MapStore) -> None:
    told = [
        MapOutline(4, 2, (0.0, 0.0, 1.0, 1.0), sigma, oriented)
        for sigma, oriented in ((None, None), (0.0, False), (1 / 3, True), (-0.0, None))
    ]
    for number, outline in enumerate(told):
        store.put("m", b"x", outline, ANY)
        assert [(one.revision, one.outline) for one in store.list(10, "").maps] == [(number + 1, outline)]
        assert store.record("m").oriented is store.load("m").record.oriented is outline.oriented


def test_demands_are_of_the_present_revision(store: MapStore) -> None:
    def refused(call: Callable[[], object]) -> int | None:
        with pytest.raises(RevisionConflictError) as caught:
            call()
        return caught.value.revision

    only_over = Preconditions(if_match=frozenset([1, 7]))
    none = Preconditions(if_none_match=EVERY_REVISION)
    assert refused(lambda: store.put("m", b"x", BOX, only_over)) is None
    assert refused(lambda: store.put("m", b"x", BOX, Preconditions(if_match=EVERY_REVISION))) is None
    assert refused(lambda: store.delete("m", only_over)) is None
    assert store.put("m", b"one", BOX, none) == (1, True)
    assert refused(lambda: store.put("m", b"x", BOX, none)) == 1
    assert refused(lambda: store.put("m", b"x", BOX, Preconditions(if_none_match=frozenset([1])))) == 1
    assert store.put("m", b"two", BOX, only_over) == (2, False)
    assert refused(lambda: store.put("m", b"x", BOX, only_over)) == 2
    assert refused(lambda: store.delete("m", only_over)) == 2
    assert store.put("m", b"three", BOX, Preconditions(if_match=EVERY_REVISION)) == (3, False)
    assert store.put("m", b"four", BOX, Preconditions(if_none_match=frozenset([1, 2]))) == (4, False)
    assert store.load("m").document == b"four"
    store.delete("m", Preconditions(if_match=frozenset([4])))
    # A map that was deleted is none, whatever revision it had.
    assert refused(lambda: store.put("m", b"x", BOX, Preconditions(if_match=frozenset([4])))) is None
    assert store.put("m", b"five", BOX, none) == (5, True)


def test_whoever_comes_first_makes_the_tables(database: str) -> None:
    calls: tuple[Callable[[MapStore], object], ...] = (
        lambda store: store.list(1, ""),
        lambda store: store.put("m", b"one", BOX, ANY),
    )
    for first in calls:
        store = MapStore(database_url(database))
        first(store)
        store.close()
    with opened(database) as store:
        assert store.load("m").document == b"one"


def test_a_directory_is_made_where_there_is_none(tmp_path: Path) -> None:
    with opened(f"sqlite:///{tmp_path / 'a' / 'b' / 'maps.sqlite3'}") as store:
        store.put("m", b"one", BOX, ANY)
    (tmp_path / "file").touch()
    with pytest.raises(ReadOnlyStoreError, match="folder"), opened(f"sqlite:///{tmp_path / 'file' / 'maps'}"):
        pass


def test_a_listing_is_in_the_order_of_bytes(store: MapStore) -> None:
    names = ["a", "B", "a.1", "a-1", "_", "Z", "a1", "A", "9"]
    for name in names:
        store.put(name, b"x", BOX, ANY)
    seen: list[str] = []
    after: str | None = ""
    sizes: list[int] = []
    while after is not None:
        page = store.list(3, after)
        sizes.append(len(page.maps))
        seen += [item.map_id for item in page.maps]
        after = page.next
    # A page that is full is the last all the same, when nothing follows.
    assert (seen, sizes) == (sorted(names), [3, 3, 3])


def test_a_listing_of_what_begins_so(store: MapStore) -> None:
    for name in ("b", "hq", "hq-", "hq-1", "hq-2", "hq-~", "hq.1", "hr", "HQ-1"):
        store.put(name.replace("~", "zz"), b"x", BOX, ANY)
    assert [item.map_id for item in store.list(9, "", "hq-").maps] == ["hq-", "hq-1", "hq-2", "hq-zz"]
    assert [item.map_id for item in store.list(2, "hq-", "hq-").maps] == ["hq-1", "hq-2"]
    assert [item.map_id for item in store.list(9, "hr", "hq-").maps] == []
    assert len(store.list(9, "").maps) == 9


def test_of_many_first_writers_none_is_lost(database: str) -> None:
    with opened(database) as one, opened(database) as other, ThreadPoolExecutor(12) as threads:
        asked = [threads.submit((one, other)[i % 2].put, "m", b"%d" % i, BOX, ANY) for i in range(24)]
        answers = [each.result() for each in asked]
        assert sorted(revision for revision, _ in answers) == list(range(1, 25))
        assert [created for _, created in answers].count(True) == 1
        last = max(range(24), key=lambda i: answers[i][0])
        assert one.load("m").document == b"%d" % last


@pytest.mark.parametrize(
    ("column", "value"),
    [
        ("revision", 7),
        ("sha256", "0" * 64),
        ("segments", 5),
        ("points", 5),
        ("size", 5),
        ("min_x", 0.5),
        ("min_y", 0.5),
        ("max_x", -1.0),
        ("max_y", -1.0),
        ("seal", "0" * 64),
    ],
)
def test_a_changed_row_is_named_and_not_used(store: MapStore, database: str, column: str, value: object) -> None:
    for name in ("before", "m", "next"):
        store.put(name, b"one", BOX, ANY)
    alter(database, f"UPDATE maps SET {column} = :value WHERE map_id = 'm'", value=value)
    for call in (store.record, store.load):
        with pytest.raises(CorruptMapError):
            call("m")
    page = store.list(10, "")
    assert ([item.map_id for item in page.maps], page.corrupt) == (["before", "next"], ["m"])
    revision, created = store.put("m", b"again", BOX, ANY)
    # Above every number that the row or the document may have had.
    assert (created, revision) == (False, 8 if column == "revision" else 2)
    assert store.load("m").document == b"again"
    assert store.list(10, "").corrupt == []


def test_a_deletion_that_was_tampered_with_is_damage(store: MapStore, database: str) -> None:
    store.put("m", b"one", BOX, ANY)
    alter(database, "UPDATE maps SET sha256 = '' WHERE map_id = 'm'")
    with pytest.raises(CorruptMapError):
        store.record("m")
    store.delete("m", ANY)  # what is damaged can be deleted
    with pytest.raises(UnknownMapError):
        store.load("m")


def test_a_changed_document_is_quarantined_for_all(database: str) -> None:
    with opened(database) as one, opened(database) as other:
        for name in ("m", "n"):
            one.put(name, b"one", BOX, ANY)
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


class AtQuarantine(logging.Handler):
    """Does something when a map is found damaged, and before it is marked so."""

    def __init__(self, call: Callable[[], object]) -> None:
        super().__init__()
        self._call = call

    def emit(self, record: logging.LogRecord) -> None:
        if "quarantined" in record.getMessage():
            self._call()


def test_only_the_revision_that_is_damaged_is_quarantined(database: str) -> None:
    """Another worker puts the map again after this one has seen the damage: that revision is whole."""
    with opened(database) as one, opened(database) as other:
        one.put("m", b"one", BOX, ANY)
        alter(database, "UPDATE map_documents SET document = :value WHERE map_id = 'm'", value=b"two")
        mending = AtQuarantine(lambda: other.put("m", b"three", BOX, ANY))
        logger = logging.getLogger("linefix")
        logger.addHandler(mending)
        try:
            with pytest.raises(CorruptMapError):
                one.load("m")
        finally:
            logger.removeHandler(mending)
        for store in (one, other):
            assert (store.load("m").document, store.record("m").revision) == (b"three", 2)


@pytest.mark.parametrize("table", ["maps", "map_documents"])
def test_a_lost_row_is_named(store: MapStore, database: str, table: str) -> None:
    store.put("m", b"one", BOX, ANY)
    store.put("m", b"two", BOX, ANY)
    alter(database, f"UPDATE {table} SET map_id = :value WHERE map_id = 'm'", value="n")
    for name in ("m", "n") if table == "maps" else ("m",):
        for call in (store.load, store.record) if table == "maps" else (store.load,):
            with pytest.raises(CorruptMapError):
                call(name)
    assert store.put("m", b"three", BOX, ANY) == (3, False)
    assert store.load("m").document == b"three"


def test_all_maps_together_take_no_more_than_they_may(database: str) -> None:
    with opened(database, 10_000) as store:
        with pytest.raises(StoreFullError):
            store.put("a", bytes(9_501), BOX, ANY)
        store.put("a", bytes(9_500), BOX, ANY)  # one map may take it all
        store.put("a", bytes(5_000), BOX, ANY)
        with pytest.raises(StoreFullError, match="10000 bytes"):
            store.put("b", bytes(5_000), BOX, ANY)
        store.put("b", bytes(3_000), BOX, ANY)
        store.put("a", bytes(6_000), BOX, ANY)  # in the place of what it takes itself
        with pytest.raises(StoreFullError):
            store.put("a", bytes(6_001), BOX, ANY)
        assert len(store.load("a").document) == 6_000
        store.delete("a", ANY)
        store.put("b", bytes(9_000), BOX, ANY)
        for number in range(3):  # ids take room, too, also of maps that are gone
            with pytest.raises(StoreFullError):
                store.put(f"c{number}", b"", BOX, ANY)


def test_a_map_that_was_put_a_thousand_times(store: MapStore, database: str) -> None:
    """Its revision is looked at as a number, whichever object holds it."""
    store.put("m", b"one", BOX, ANY)
    row = row_of(replace(store.record("m"), revision=1000))
    alter(database, "UPDATE maps SET revision = 1000, seal = :seal WHERE map_id = 'm'", seal=row["seal"])
    alter(database, "UPDATE map_documents SET revision = 1000 WHERE map_id = 'm'")
    assert store.load("m").record.revision == 1000
    assert store.put("m", b"two", BOX, Preconditions(if_match=frozenset([1000]))) == (1001, False)


def test_one_map_s_changes_leave_the_others_alone(store: MapStore) -> None:
    for name in ("c", "b", "a"):
        assert store.put(name, name.encode(), BOX, ANY) == (1, True)
    store.delete("a", ANY)
    assert [store.load(name).document for name in ("b", "c")] == [b"b", b"c"]
    assert store.put("b", b"B", MapOutline(7, 0, (0.0, 0.0, 9.0, 9.0)), ANY) == (2, False)
    listed = [(item.map_id, item.revision, item.outline.segments) for item in store.list(10, "").maps]
    assert listed == [("b", 2, 7), ("c", 1, 4)]


def test_the_maps_of_one_prefix_take_no_more_than_half(database: str) -> None:
    """Class of attack: what is shared by all is filled by one. Ids that were used once count, too."""
    with opened(database, 20_000) as store:
        store.put("hq-a", bytes(5_000), BOX, ANY, "hq-")
        with pytest.raises(StoreFullError, match="10000 bytes"):
            store.put("hq-b", bytes(4_001), BOX, ANY, "hq-")
        store.put("hq-b", bytes(4_000), BOX, ANY, "hq-")
        store.put("hq-a", bytes(5_000), BOX, ANY, "hq-")  # in the place of what it takes itself
        with pytest.raises(StoreFullError):
            store.put("hq-c", b"", BOX, ANY, "hq-")
        with pytest.raises(StoreFullError):
            store.put("hq-a", bytes(5_001), BOX, ANY, "hq-")
        store.put("lab-a", bytes(9_000), BOX, ANY, "lab-")  # other prefixes have their own half
        store.delete("hq-b", ANY)
        for number in range(8):
            store.put(f"hq-{number}", b"", BOX, ANY, "hq-")
            store.delete(f"hq-{number}", ANY)
        with pytest.raises(StoreFullError):
            store.put("hq-more", bytes(1), BOX, ANY, "hq-")
