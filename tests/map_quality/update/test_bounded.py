"""Memory and time of an update are bounded by what scans see, not by the map or by products of request fields."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

import map_quality
from association import Deadline, MapIndex
from registration import Segments

from .hall import PILLAR, RACK, segments, visit

SIGMA = 0.02


class Looked(Deadline):
    """A deadline that passes when it was looked at so many times."""

    left = 0

    @property
    def passed(self) -> bool:
        Looked.left -= 1
        return Looked.left < 0


def test_memory_is_that_of_what_the_scans_see() -> None:
    far = [[100.0, 50.0 + 5.0 * k, 10_000.0, 50.0 + 5.0 * k] for k in range(10)]
    far += [[100.0 + 3.0 * k, -20.0, 101.5 + 3.0 * k, -19.0 - k % 7] for k in range(2000)]
    walls = Segments.from_array(np.concatenate([segments(RACK, PILLAR).endpoints, far]))
    index = MapIndex.build(walls, SIGMA)
    scans = [one for k in range(10) for one in visit(segments(PILLAR), f"day {k}", k)[::3]]
    map_quality.update(index, scans, Deadline())
    tracemalloc.start()
    try:
        found = map_quality.update(index, scans)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert [one.segments for one in found.changes] == [(12, 13, 14, 15)]
    assert len(found.sharpened.segments) > 8
    assert peak < 100e6  # the index takes half of it


@pytest.mark.parametrize("looks", [1, 30, 100, 300, 1000])
def test_a_deadline_ends_an_update_wherever_it_is(looks: int) -> None:
    scans = [one for k in range(3) for one in visit(segments(PILLAR), f"day {k}", k)]
    Looked.left = looks
    found = map_quality.update(MapIndex.build(segments(RACK, PILLAR), SIGMA), scans, Looked())
    assert not found.complete
    assert Looked.left > -100
