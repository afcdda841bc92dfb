"""The file that SQLite keeps the maps in."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from service.app import create_app
from service.database_location import database_url
from service.errors import StoreAwayError
from service.maps import MapStore
from service.settings import Settings

from .stores import BOX


def open_store(path: Path, *, may_make: bool = True) -> MapStore:
    store = MapStore(database_url(f"sqlite:///{path}"), may_make=may_make)
    store.open()
    return store


def put(store: MapStore) -> None:
    store.put("m", b"{}", BOX)


def test_it_is_for_its_owner_alone(tmp_path: Path) -> None:
    before = os.umask(0o022)
    try:
        store = open_store(tmp_path / "data" / "maps.sqlite3")
        put(store)
    finally:
        os.umask(before)
    for path in (tmp_path / "data", *(tmp_path / "data").iterdir()):
        assert stat.S_IMODE(path.stat().st_mode) & 0o077 == 0, path
    store.close()


def test_one_that_is_moved_away_is_missed(tmp_path: Path) -> None:
    path, away = tmp_path / "maps.sqlite3", tmp_path / "away"
    store = open_store(path)
    put(store)
    path.rename(away)
    for call in (store.open, lambda: store.load("m"), lambda: put(store), lambda: store.list(10, "")):
        with pytest.raises(StoreAwayError, match="missing"):
            call()
    assert not path.exists()
    away.rename(path)
    assert store.load("m").record.revision == 1
    put(store)
    assert store.load("m").record.revision == 2
    store.close()


def test_who_stands_in_for_another_makes_none(tmp_path: Path) -> None:
    path = tmp_path / "maps.sqlite3"
    with pytest.raises(StoreAwayError):
        open_store(path, may_make=False)
    assert not path.exists()
    open_store(path).close()
    open_store(path, may_make=False).close()


def test_none_of_several_workers_makes_it(tmp_path: Path) -> None:
    """A process that was still starting when the file was moved created it again."""
    services = create_app(Settings(data_dir=tmp_path, workers=2, searches=2)).state.services
    with pytest.raises(StoreAwayError):
        services.store.open()
    assert list(tmp_path.iterdir()) == []
    services.close()
