"""Width of a scan and facing of its segments."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings

from association.layout import ENDS, POINT, as_records
from association.scan.extents import extent, facing_away
from registration.layout import Records

from ..kernels.drawn import SEEDS


def sent(rows: np.ndarray) -> Records:
    records = as_records(ENDS, rows)
    records.flags.writeable = False
    return records


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_the_extent_is_that_of_the_ends_in_the_widest_direction(seed: int) -> None:
    """To a direction of ten degrees."""
    ends = np.random.default_rng(seed).uniform(-9.0, 9.0, (7, 4))
    corners = ends.reshape(-1, 2)
    widest = np.linalg.norm(corners[:, None] - corners, axis=2).max()
    assert np.cos(np.radians(5.0)) * widest - 1e-9 <= extent(sent(ends)) <= widest + 1e-9


def test_nothing_has_no_extent() -> None:
    assert extent(sent(np.zeros((0, 4)))) == 0.0


@given(SEEDS)
@settings(max_examples=30, deadline=None)
def test_facing_away(seed: int) -> None:
    """From one place, and from one place for each segment, of which one is unknown."""
    rng = np.random.default_rng(seed)
    ends, places = rng.uniform(-9.0, 9.0, (8, 4)), rng.uniform(-9.0, 9.0, (8, 2))
    places[3] = np.nan
    along = ends[:, 2:] - ends[:, :2]
    normals = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
    middles = 0.5 * (ends[:, :2] + ends[:, 2:])
    for seen_from in (places, places[:1]):
        beside = np.sum(normals * (seen_from - middles), axis=1)
        for least in (0.0, 1.5):
            expected = np.count_nonzero(beside < -least)
            assert facing_away(sent(ends), as_records(POINT, seen_from), least) == expected
