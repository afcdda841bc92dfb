"""Class of attack: work and memory that two inputs within their limits have as a product.

A map check compares walls with walls, so what it does and holds may grow with the square of what one cell lists. It
holds little, whatever the map, and ends wherever it is cancelled.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress

import numpy as np
import pytest

from association import CancelledError, Deadline, IndexingEndedError, MapIndex
from map_quality import check_map
from map_quality.check import check
from registration import Segments
from registration.layout import Floats
from tests.association.scenes import allocates_less_than

COUNT = 40_000
MOST_HELD = 100_000_000  # bytes in addition to the index


def scattered(width: float, length: float, count: int = COUNT) -> Floats:
    rng = np.random.default_rng(5)
    begins, angles = rng.uniform(0.0, width, (count, 2)), rng.uniform(0.0, 2.0 * np.pi, count)
    return np.hstack([begins, begins + length * np.stack([np.cos(angles), np.sin(angles)], axis=1)])


def through_one_place() -> Floats:
    angles = np.random.default_rng(6).uniform(0.0, 2.0 * np.pi, COUNT)
    away = 5.0 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    return np.hstack([-away, away]) + np.random.default_rng(7).uniform(-0.3, 0.3, (COUNT, 1))


def overlapping() -> Floats:
    shift = np.random.default_rng(8).uniform(-0.01, 0.01, COUNT)
    return np.stack([shift, 0.0 * shift, 6.0 + shift, 0.0 * shift], axis=1)


def side_by_side() -> Floats:
    y = np.linspace(0.0, 40.0, COUNT)
    return np.stack([0.0 * y, y, 30.0 + 0.0 * y, y], axis=1)


def in_steps() -> Floats:
    x = 0.1 * np.arange(COUNT)
    return np.stack([x % 100.0, 0.1 * (x // 100.0), x % 100.0 + 0.05, 0.1 * (x // 100.0) + 0.05], axis=1)


MAPS: dict[str, Callable[[], Floats]] = {
    "some sixty in each cell": lambda: scattered(36.0, 0.5),
    "thinly all over": lambda: scattered(140.0, 3.0),
    "all in one cell": lambda: scattered(0.5, 0.2),
    "all crossing": through_one_place,
    "all on one another": overlapping,
    "all parallel": side_by_side,
    "a staircase of short ones": in_steps,
}


class Looks(Deadline):
    """Counts the looks at it, and is cancelled at one of them."""

    def __init__(self, most: int | None = None) -> None:
        super().__init__()
        self.count, self._most = 0, most

    @property
    def passed(self) -> bool:
        self.count += 1
        if self.count == self._most:
            self.cancel()
        return self.cancelled


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=() if kind == "all on one another" else pytest.mark.long) for kind in MAPS]
)
def test_a_check_holds_little(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Until the search of views, whose memory is that of any search."""
    monkeypatch.setattr(check, "find_look_alikes", lambda *_, **__: check.Likeness())
    index = MapIndex.build(Segments.from_array(MAPS[kind]()))
    with allocates_less_than(MOST_HELD), suppress(CancelledError):
        check_map(index, Looks(most=4_000))


def test_a_check_is_given_up_wherever_it_is_cancelled() -> None:
    index, counting = MapIndex.build(Segments.from_array(scattered(12.0, 0.5, 300))), Looks()
    check_map(index, counting)
    assert counting.count > 100
    for most in np.unique(np.geomspace(1, counting.count // 2, 12).astype(int)).tolist():
        looks = Looks(most)
        with pytest.raises(CancelledError):
            check_map(index, looks)
        assert looks.count < most + 20, "soon after it there is nothing more to do"


def test_an_index_is_given_up_wherever_the_deadline_passes() -> None:
    segments = Segments.from_array(scattered(12.0, 0.5, COUNT // 9))
    counting = Looks()
    MapIndex.build(segments, deadline=counting)
    assert counting.count > 6
    for most in np.unique(np.linspace(1, counting.count, 16).astype(int)).tolist():
        with pytest.raises(IndexingEndedError):
            MapIndex.build(segments, deadline=Looks(most))


def test_without_time_for_an_index_of_both_directions_the_check_says_that_it_is_incomplete() -> None:
    index = MapIndex.build(Segments.from_array(scattered(12.0, 0.5, COUNT // 9)))
    with pytest.raises(IndexingEndedError):
        index.undirected_by(Deadline(time.monotonic()))
    late = check_map(index, Deadline(time.monotonic()), oriented=False)
    assert (late.complete, late.viewpoints) == (False, 0)
    kept = index.undirected_by(Deadline())
    assert kept is index.undirected
