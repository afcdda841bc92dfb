"""Flipped bits in the file of the database: a map comes back as it was put, or is named; never changed, never lost."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from service.database_location import database_url
from service.errors import CorruptMapError, StoreAwayError, StoreError, UnknownMapError
from service.maps import MapOutline, MapStore

NAMED = (CorruptMapError, StoreAwayError)  # the second where the flip is in the version of the tables, or their names
BOX = MapOutline(4, 2, (-1.5, 0.0, 1.0, 1e5))
# Small ones lie among the rows, large ones on pages of their own.
DOCUMENTS = {f"map-{i}": random.Random(i).randbytes(200 if i % 3 else 3000) for i in range(12)}


def put_all(store: MapStore) -> None:
    for _ in range(2):
        for name, document in DOCUMENTS.items():
            store.put(name, document, BOX)
    store.put("gone", b"x", BOX)
    store.delete("gone")


def attempt(call: Callable[[], Any]) -> Any:
    """Return what a call returns, or the kind of error that the store raises; anything else is a defect."""
    try:
        return call()
    except StoreError as error:
        return type(error)


def look(store: MapStore) -> Counter[str]:
    """Count what becomes of every map; a wrong one fails."""
    seen: Counter[str] = Counter()
    for name, document in DOCUMENTS.items():
        found = attempt(lambda name=name: store.load(name))
        if isinstance(found, type):
            assert found in NAMED, (name, found)
            seen["named" if found is CorruptMapError else "refused"] += 1
        else:
            assert (found.document, found.record.revision) == (document, 2), name
            seen["whole"] += 1
    assert attempt(lambda: store.load("gone")) in (UnknownMapError, *NAMED)
    page = attempt(lambda: store.list(100, ""))
    if isinstance(page, type):
        assert page in NAMED
    else:
        for item in page.maps:
            assert (item.revision, item.outline) == (2, BOX), item
    return seen


def heal(store: MapStore) -> Counter[str]:
    """Put every map that is damaged again, and see whether that helped."""
    seen: Counter[str] = Counter()
    for name, document in DOCUMENTS.items():
        if attempt(lambda name=name: store.load(name)) is not CorruptMapError:
            continue
        put = attempt(lambda name=name, document=document: store.put(name, document, BOX))
        if isinstance(put, type):
            assert put is CorruptMapError
            seen["not healed"] += 1
        else:
            assert put[0] > 2
            assert store.load(name).document == document
            seen["healed"] += 1
    return seen


@pytest.mark.parametrize("flips", [100, pytest.param(10_000, marks=pytest.mark.long)])
def test_a_flipped_bit_changes_no_map(tmp_path: Path, flips: int) -> None:
    path = tmp_path / "maps.sqlite3"
    url = database_url(f"sqlite:///{path}")
    store = MapStore(url)
    put_all(store)
    store.close()
    good = path.read_bytes()
    draw = random.Random(flips)
    total: Counter[str] = Counter()
    for _ in range(flips):
        place, bit = draw.randrange(len(good)), 1 << draw.randrange(8)
        path.write_bytes(good[:place] + bytes([good[place] ^ bit]) + good[place + 1 :])
        store = MapStore(url)
        try:
            seen = look(store)
            total += seen
            if seen["named"]:
                total["flips with effect"] += 1
                total += heal(store)
        except Exception as error:
            error.add_note(f"bit {bit} of byte {place}")
            raise
        finally:
            store.close()
    print(f"\n{flips} flips in {len(good)} bytes, {dict(total)}")
    assert total["named"] > 0
    assert total["healed"] > total["not healed"]
