"""Indexed maps in memory."""

from __future__ import annotations

import math
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from association import Deadline, MapIndex
from registration import Segments
from service.maps import CachedMap, IndexCache
from service.maps.errors import IndexNotReadyError
from service.settings import Settings
from service.telemetry.metrics import Metrics

NO_END = Deadline()
INDEX = MapIndex.build(Segments.from_array([[0.0, 0.0, 1.0, 0.0]]), 0.0)


def a_map(size: int) -> CachedMap:
    return CachedMap(INDEX, "map", size)


def test_the_least_recently_used_goes_first() -> None:
    cache = IndexCache(100, Metrics())
    for name in "abc":
        cache.get(name, lambda: a_map(30), NO_END)
    cache.get("a", lambda: pytest.fail("is there"), NO_END)
    cache.get("d", lambda: a_map(30), NO_END)
    assert (len(cache), cache.bytes) == (3, 90)
    cache.get("a", lambda: pytest.fail("is there"), NO_END)
    built: list[str] = []

    def build() -> CachedMap:
        built.append("b")
        return a_map(30)

    cache.get("b", build, NO_END)
    assert built == ["b"]


def test_room_is_made_before_something_is_built() -> None:
    cache = IndexCache(100, Metrics())
    for name in "abc":
        cache.get(name, lambda: a_map(30), NO_END)
    cache.make_room(40)
    assert (len(cache), cache.bytes) == (2, 60)
    cache.get("c", lambda: pytest.fail("is there"), NO_END)
    cache.make_room(1000)
    assert (len(cache), cache.bytes) == (0, 0)


def test_what_is_too_large_is_used_and_not_kept() -> None:
    cache = IndexCache(10, Metrics())
    assert cache.get("a", lambda: a_map(30), NO_END).bytes == 30
    assert (len(cache), cache.bytes) == (0, 0)


def test_callers_at_the_same_time_share_one_build() -> None:
    cache = IndexCache(100, Metrics())
    release, builds = threading.Event(), []

    def build() -> CachedMap:
        builds.append(1)
        release.wait(60)
        return a_map(1)

    with ThreadPoolExecutor(4) as threads:
        asked = [threads.submit(cache.get, "a", build, NO_END) for _ in range(4)]
        time.sleep(0.05)
        release.set()
        answers = [one.result(60) for one in asked]
    assert len(builds) == 1
    assert all(answer is answers[0] for answer in answers)


def test_who_waits_for_a_build_that_fails_is_told_so() -> None:
    cache = IndexCache(100, Metrics())
    release = threading.Event()

    def fail() -> CachedMap:
        release.wait(60)
        raise ZeroDivisionError

    with ThreadPoolExecutor(2) as threads:
        asked = [threads.submit(cache.get, "a", fail, NO_END) for _ in range(2)]
        time.sleep(0.05)
        release.set()
        for one in asked:
            with pytest.raises(ZeroDivisionError):
                one.result(60)
    assert cache.get("a", lambda: a_map(1), NO_END).bytes == 1


def test_what_fits_exactly_is_kept() -> None:
    cache = IndexCache(60, Metrics())
    for name in "ab":
        cache.get(name, lambda: a_map(30), NO_END)
    assert (len(cache), cache.bytes) == (2, 60)
    cache.make_room(0)
    assert len(cache) == 2
    cache.get("c", lambda: a_map(60), NO_END)
    assert (len(cache), cache.bytes) == (1, 60)
    cache.get("d", lambda: a_map(121), NO_END)
    cache.get("c", lambda: pytest.fail("is there"), NO_END)


def test_what_is_larger_than_the_cache_is_kept_alone_until_the_next_comes() -> None:
    cache = IndexCache(60, Metrics())
    cache.get("a", lambda: a_map(30), NO_END)
    cache.get("b", lambda: a_map(61), NO_END)
    assert (len(cache), cache.bytes) == (1, 61)
    cache.get("b", lambda: pytest.fail("is there"), NO_END)
    cache.make_room(0)
    assert len(cache) == 0
    cache.get("b", lambda: a_map(120), NO_END)
    cache.get("a", lambda: a_map(30), NO_END)
    assert (len(cache), cache.bytes) == (1, 30)


def test_the_default_cache_keeps_the_largest_map() -> None:
    """Of walls of 5 m in all directions, which are on many lists; one without directions may be larger than that."""
    rng = np.random.default_rng(1)
    count = Settings().max_map_segments
    middles, angles = rng.uniform(0.0, 1e3, (count, 2)), rng.uniform(-math.pi, math.pi, count)
    half = 2.5 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    index = MapIndex.build(Segments.from_array(np.hstack([middles - half, middles + half])))
    cache = IndexCache(Settings().cache_bytes, Metrics())
    for _ in range(2):
        cache.get("a", lambda: CachedMap(index, "map", index.nbytes), NO_END)
    assert cache.has("a")
    assert cache.bytes <= Settings().cache_bytes


def test_hits_and_misses_are_counted() -> None:
    metrics = Metrics()
    cache = IndexCache(100, metrics)
    for name in "aab":
        cache.get(name, lambda: a_map(1), NO_END)
    text = metrics.rendered().decode()
    assert "linefix_map_cache_hits_total 1.0" in text
    assert "linefix_map_cache_misses_total 2.0" in text


def test_a_failed_build_is_not_remembered() -> None:
    cache = IndexCache(100, Metrics())
    with pytest.raises(ZeroDivisionError):
        cache.get("a", lambda: a_map(1 // 0), NO_END)
    assert cache.get("a", lambda: a_map(1), NO_END).bytes == 1


@pytest.mark.parametrize("cancelled", [False, True])
def test_nobody_waits_for_a_build_beyond_the_deadline_and_it_is_kept_all_the_same(cancelled: bool) -> None:
    cache = IndexCache(100, Metrics())
    begun, release = threading.Event(), threading.Event()

    def build() -> CachedMap:
        begun.set()
        release.wait(60)
        return a_map(1)

    deadline = Deadline() if cancelled else Deadline(time.monotonic() + 0.1)
    with ThreadPoolExecutor(2) as threads:
        building = threads.submit(cache.get, "a", build, NO_END)
        begun.wait(60)
        waiting = threads.submit(cache.get, "a", build, deadline)
        if cancelled:
            deadline.cancel()
        with pytest.raises(IndexNotReadyError):
            waiting.result(60)
        assert not building.done()
        release.set()
        made = building.result(60)
    assert cache.get("a", lambda: pytest.fail("is there"), deadline) is made
