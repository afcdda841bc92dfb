"""Memory and time of an update are bounded by what scans see, not by the map or by products of request fields."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from association import Deadline, MapIndex
from map_quality.update.beams import Chunks, follow
from map_quality.update.scans import Localized, search
from registration import Segments
from tests.association.scenes import allocates_less_than

from .hall import PILLAR, RACK, SCANNER, segments, update, visit

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
    update(index, scans, Deadline())
    with allocates_less_than(100e6):  # the index takes half of it
        found = update(index, scans)
    assert [one.segments for one in found.changes] == [(12, 13, 14, 15)]
    assert len(found.sharpened.segments) > 8


def test_memory_is_bounded_where_thousands_of_beams_pass_thousands_of_walls() -> None:
    hall, scanner = segments(RACK, PILLAR), replace(SCANNER, beams=4000, angle_increment=math.tau / 4000)
    one = visit(hall, "monday", 1, scanner)[0]
    localized = Localized(0, one, search(MapIndex.build(hall, SIGMA), one, Deadline()), False)
    y = np.linspace(0.1, 7.9, 12_000)
    walls = Chunks.of(Segments.from_array(np.stack([np.full_like(y, 0.1), y, np.full_like(y, 11.9), y], axis=1)))
    with allocates_less_than(100e6):
        seen = follow(walls, localized, SIGMA, Deadline(), oriented=True)
    assert seen.counts[:, 0].sum() > 10_000


def test_a_deadline_ends_an_update_wherever_it_is() -> None:
    scans = [one for k in range(3) for one in visit(segments(PILLAR), f"day {k}", k)]
    index = MapIndex.build(segments(RACK, PILLAR), SIGMA)
    Looked.left = 100_000
    assert update(index, scans, Looked()).complete
    looks = 100_000 - Looked.left
    for left in (1, looks // 30, looks // 10, looks // 3, looks - 1):
        Looked.left = left
        assert not update(index, scans, Looked()).complete
        assert Looked.left > -100
