"""Class of attack: work and memory that two inputs within their limits have as a product.

A map check compares walls with walls, so what it does and holds may grow with the square of what one cell lists. It
holds little, whatever the map, and no stage goes on for long without a look at the deadline.
"""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable

import numpy as np
import pytest

from association import CancelledError, Deadline, IndexingEndedError, MapIndex
from map_quality import check_map
from registration import Segments
from registration.layout import Floats

COUNT = 40_000
MOST_BETWEEN_LOOKS = 1.0  # s of this thread's processor time; estimating crossings takes 0.5, whatever the map
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
    """Notes how much of this thread's processor time passes between two looks at the deadline."""

    def __init__(self, most: int | None = None) -> None:
        super().__init__()
        self.count, self.longest, self._most, self._last = 0, 0.0, most, time.thread_time()

    @property
    def passed(self) -> bool:
        now = time.thread_time()
        self.longest, self._last = max(self.longest, now - self._last), now
        self.count += 1
        if self.count == self._most:
            self.cancel()
        return Deadline.passed.fget(self)  # type: ignore[attr-defined, no-any-return]

    def ended(self) -> float:
        """Return the longest time, up to now."""
        _ = self.passed
        return self.longest


@pytest.fixture(scope="module", autouse=True)
def warm() -> None:
    """Kernels are compiled before anything is timed."""
    check_map(MapIndex.build(Segments.from_array(scattered(36.0, 0.5)[:300])), oriented=False)


@pytest.mark.parametrize("kind", MAPS)
def test_no_map_is_indexed_without_a_look_at_the_deadline(kind: str) -> None:
    """Without directions it has twice as many walls."""
    looks = Looks()
    MapIndex.build(Segments.from_array(MAPS[kind]()), oriented=False, deadline=looks)
    assert looks.ended() < MOST_BETWEEN_LOOKS


@pytest.mark.parametrize("kind", MAPS)
def test_every_stage_of_a_check_looks_at_the_deadline_and_holds_little(kind: str) -> None:
    index = MapIndex.build(Segments.from_array(MAPS[kind]()))
    # Long enough for all but the search of views, which has a deadline of its own.
    looks = Looks(most=4_000)
    tracemalloc.start()
    try:
        check_map(index, looks)
    except CancelledError:
        pass
    finally:
        held = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    assert looks.ended() < MOST_BETWEEN_LOOKS
    assert held < MOST_HELD


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
