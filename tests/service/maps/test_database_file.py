"""The file that SQLite keeps the maps in."""

from __future__ import annotations

import os
import stat
from contextlib import closing, nullcontext
from pathlib import Path

import pytest

from service.app import create_app
from service.database_location import database_url
from service.errors import StoreAwayError
from service.maps import MapStore
from service.settings import Settings

from .stores import BOX, opened


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
