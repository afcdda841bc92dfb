"""Operations whose client hangs up, and the stages of an import after its reading."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from association import CancelledError, Deadline, MapIndex
from linefix.documents.analysis import AnalyzeRequest
from linefix.documents.errors import DeadlinePassedError
from linefix.operations import Steps, Stopwatch, analysis_steps, worked
from service.app import create_app
from service.settings import Settings
from service.work.results import index_import
from simulation import rectangle_room
from tests.service.maps.stores import Lookup, inline

BOX = [[-2.5, -1.5, -2.5, 0.0], [-2.5, 0.0, -1.0, 0.0], [-1.0, 0.0, -1.0, -1.5], [-1.0, -1.5, -2.5, -1.5]]
ASKED = AnalyzeRequest.model_validate({"spacing": 2.5, "drive": 2.0, "landmark": BOX, "laser": {"beams": 180}})


def test_who_hangs_up_within_a_drive_ends_it() -> None:
    deadline = Deadline()
    steps = analysis_steps(MapIndex.build(rectangle_room().segments, 0.0), ASKED, deadline)

    def left_after(count: int) -> Steps:
        for _ in range(count):
            yield next(steps)
        deadline.cancel()
        return (yield from steps)

    with pytest.raises(CancelledError):
        worked(left_after(4), Stopwatch(), deadline)
    assert list(steps) == []


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
