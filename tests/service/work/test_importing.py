"""The stages of an import after its reading are bounded as the reading is."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from association import CancelledError, Deadline
from linefix.documents.errors import DeadlinePassedError
from service.app import create_app
from service.settings import Settings
from service.work.results import index_import
from tests.service.maps.stores import Lookup, inline


def test_an_import_is_indexed_until_its_deadline_or_its_client_is_gone(lookup: Lookup) -> None:
    """Class of attack: work without a client."""
    with pytest.raises(DeadlinePassedError):
        index_import(lookup, inline(), Deadline(time.monotonic()))
    gone = Deadline()
    gone.cancel()
    with pytest.raises(CancelledError):
        index_import(lookup, inline(), gone)


def test_an_import_takes_no_place_of_maps_that_are_searched(lookup: Lookup) -> None:
    index = index_import(lookup, inline(), Deadline())
    assert index.directed == len(inline().segments)
    assert (len(lookup.cache), lookup.cache.bytes) == (0, 0)


def test_readers_of_several_workers_have_the_memory_of_one(tmp_path: Path) -> None:
    """Class of attack: a limit of a process that is one of each of several."""
    for workers, bound in ((2, 500_000_000), (8, 400_000_000)):  # with less no file is read at all
        services = create_app(Settings(data_dir=tmp_path, workers=workers, searches=8)).state.services
        assert (services.import_bounds.memory_bytes, services.importing.slots) == (bound, 1)
        services.close()
