"""Indexed maps in memory."""

from __future__ import annotations

import math
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext

import numpy as np
import pytest

from association import Deadline, MapIndex
from registration import Segments
from service.errors import IndexNotReadyError
from service.maps import CachedMap, IndexCache
from service.settings import Settings
from service.telemetry.metrics import Metrics

NO_END = Deadline()
INDEX = MapIndex.build(Segments.from_array([[0.0, 0.0, 1.0, 0.0]]), 0.0)


def a_map(size: int) -> CachedMap:
    return CachedMap(INDEX, {None: "map"}, size)


# Maps that are looked up, and room that is made before something is built; what was built; maps and bytes at the end.
LOOKED_UP = {
    "the least recently used goes first": (100, "a30 b30 c30 a30 d30 a30 b30", "abcdb", (3, 90)),
    "room is made": (100, "a30 b30 c30 room40 c30", "abc", (2, 60)),
    "as much as there is": (100, "a30 b30 room1000", "ab", (0, 0)),
    "what is too large is used and not kept": (10, "a30 a30", "aa", (0, 0)),
    "what fits exactly is kept": (60, "a30 b30 room0 a30 c60 d121 c60", "abcd", (1, 60)),
    "what is larger than the cache is kept alone until the next comes": (60, "a30 b61 b61", "ab", (1, 61)),
    "and goes where room is made": (60, "b61 room0 b120 a30", "bba", (1, 30)),
}


@pytest.mark.parametrize("kind", LOOKED_UP)
def test_what_is_kept(kind: str) -> None:
    capacity, steps, wanted, held = LOOKED_UP[kind]
    metrics = Metrics()
    cache, built, gets = IndexCache(capacity, metrics), "", 0
    for step in steps.split():
        if step.startswith("room"):
            cache.make_room(int(step[4:]))
            continue
        name, size = step[0], int(step[1:])
        there = cache.has(name)
        assert cache.get(name, lambda size=size: a_map(size), NO_END).bytes == size  # type: ignore[misc]
        built, gets = built + name * (not there), gets + 1
    assert (built, (len(cache), cache.bytes)) == (wanted, held)
    counts = metrics.rendered().decode()
    assert f"linefix_map_cache_hits_total {gets - len(built)}.0" in counts
    assert f"linefix_map_cache_misses_total {len(built)}.0" in counts


@pytest.mark.parametrize("fails", [False, True])
def test_callers_at_the_same_time_share_one_build(fails: bool) -> None:
    """Also one that fails, which is not remembered."""
    cache, release, builds = IndexCache(100, Metrics()), threading.Event(), []

    def build() -> CachedMap:
        builds.append(a_map(2))
        release.wait(60)
        if fails:
            raise ZeroDivisionError
        return builds[0]

    with ThreadPoolExecutor(4) as threads:
        asked = [threads.submit(cache.get, "a", build, NO_END) for _ in range(4)]
        time.sleep(0.05)
        release.set()
        for one in asked:
            with pytest.raises(ZeroDivisionError) if fails else nullcontext():
                assert one.result(60) is builds[0]
    assert len(builds) == 1
    assert cache.get("a", lambda: a_map(1), NO_END).bytes == (1 if fails else 2)


@pytest.mark.long
def test_the_default_cache_keeps_the_largest_map() -> None:
    """Of walls of 5 m in all directions, which are on many lists; one without directions may be larger than that."""
    rng = np.random.default_rng(1)
    count = Settings().max_map_segments
    middles, angles = rng.uniform(0.0, 1e3, (count, 2)), rng.uniform(-math.pi, math.pi, count)
    half = 2.5 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    index = MapIndex.build(Segments.from_array(np.hstack([middles - half, middles + half])))
    cache = IndexCache(Settings().cache_bytes, Metrics())
    for _ in range(2):
        cache.get("a", lambda: CachedMap(index, {None: "map"}, index.nbytes), NO_END)
    assert cache.has("a")
    assert cache.bytes <= Settings().cache_bytes


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
