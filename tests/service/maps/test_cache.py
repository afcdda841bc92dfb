"""From the map of a request to its index, and indexed maps in memory."""

from __future__ import annotations

import math
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import nullcontext
from typing import Any

import numpy as np
import pytest

from association import Deadline, InvalidMapError, MapIndex
from linefix.documents import examples
from linefix.documents.errors import TooManyError
from linefix.documents.parts import MapDocument, MapPrefix, NamedMap, StoredMap
from registration import Segments
from service.errors import BusyStoreError, IndexNotReadyError
from service.maps import CachedMap, IndexCache, MapOutline
from service.maps.lookup import OVERHEAD, outline_of
from service.parsing.child import LARGE
from service.settings import Settings
from service.telemetry.metrics import Metrics

from .stores import Lookup, inline

NO_END = Deadline()
INDEX = MapIndex.build(Segments.from_array([[0.0, 0.0, 1.0, 0.0]]), 0.0)


def a_map(size: int) -> CachedMap:
    return CachedMap(INDEX, size)


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
        cache.get("a", lambda: CachedMap(index, index.nbytes), NO_END)
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


@pytest.mark.parametrize(
    "parts", [{"sigma": 0.05}, {"frame_id": "other"}, {"segments": [*examples.WALLS[:-1], [-4.0, 3.0, -4.0, -3.001]]}]
)
def test_everything_that_an_answer_rests_on_names_the_index(lookup: Lookup, parts: dict[str, Any]) -> None:
    plain, revision = lookup.look(inline(), oriented=True)
    assert revision is None
    other, _ = lookup.look(inline(**parts), oriented=True)
    assert other is not plain
    assert other.maps.frame_id == parts.get("frame_id", "map")
    assert isinstance(other.maps, MapIndex)
    assert other.maps.sigma == parts.get("sigma")
    assert lookup.look(inline(), oriented=True)[0] is plain


def test_a_map_without_directions_is_another_one_in_the_cache(lookup: Lookup) -> None:
    one, other, again = (lookup.look(inline(), oriented=oriented)[0] for oriented in (True, False, True))
    assert isinstance(one.maps, MapIndex)
    assert isinstance(other.maps, MapIndex)
    assert len(other.maps.segments) == 2 * len(one.maps.segments)
    assert again is one
    assert lookup.cache.bytes == one.maps.nbytes + other.maps.nbytes + 2 * OVERHEAD
    assert other.maps.undirected is other.maps


def test_a_map_that_changes_between_two_looks_is_looked_at_again(lookup: Lookup) -> None:
    lookup.put("m", segments=examples.WALLS)
    load, changes = lookup.store.load, [1, 2]

    def changing(map_id: str) -> Any:
        if changes:
            lookup.put("m", segments=examples.WALLS, frame_id=f"change {changes.pop()}")
        return load(map_id)

    lookup.store.load = changing  # type: ignore[method-assign]
    found, revision = lookup.look(StoredMap(map_id="m"), oriented=True)
    assert (found.maps.frame_id, revision) == ("change 1", 3)


def test_a_map_that_changes_while_its_search_waits_is_not_taken_for_what_it_was(lookup: Lookup) -> None:
    lookup.put("m", segments=examples.WALLS)
    lookup.look(StoredMap(map_id="m"), oriented=True)
    found = lookup.find("m", oriented=True)
    assert found.document is None
    lookup.cache.make_room(lookup.cache.bytes + 10_000_000)
    assert lookup.indexed(found, oriented=True, deadline=Deadline()).maps.frame_id == "map"  # read again
    lookup.cache.make_room(lookup.cache.bytes + 10_000_000)
    lookup.put("m", segments=examples.WALLS, frame_id="other")
    with pytest.raises(BusyStoreError):
        lookup.indexed(found, oriented=True, deadline=Deadline())


def test_a_large_map_is_read_by_the_other_process(lookup: Lookup) -> None:
    begins = np.random.default_rng(0).uniform(1e3, 2e3, (12_000, 2))
    rows = np.hstack([begins, begins + np.array([1.0, 0.1])]).tolist()
    lookup.put("small", segments=examples.WALLS)
    lookup.put("large", segments=rows)
    assert len(lookup.store.load("large").document) > LARGE
    lookup.look(StoredMap(map_id="small"), oriented=True)
    assert lookup.parser.pid is None
    assert lookup.look(StoredMap(map_id="large"), oriented=True)[0].maps.nbytes > 0
    assert lookup.parser.pid is not None


def test_several_maps_are_counted_by_their_records(lookup: Lookup, monkeypatch: pytest.MonkeyPatch) -> None:
    """They were loaded and parsed first, and their points were not counted: 9.6 GB."""
    for number in range(2):
        for kind, counts in (("segments", (150_000, 0)), ("points", (4, 150_000))):
            lookup.store.put(f"{kind}-{number}", b"{}", MapOutline(*counts, (0.0, 0.0, 1.0, 1.0)))
    monkeypatch.setattr(lookup.store, "load", lambda _: pytest.fail("loaded"))
    for kind in ("segments", "points"):
        for asked in (MapPrefix(prefix=kind), [StoredMap(map_id=f"{kind}-{number}") for number in range(2)]):
            with pytest.raises(TooManyError, match=kind) as caught:
                lookup.find_together(asked, "")
            assert caught.value.pointer == "/maps"
    found = lookup.find_together(
        [StoredMap(map_id="points-0"), NamedMap.model_validate({"map_id": "x", "segments": examples.WALLS})], ""
    )
    assert found.unread_bytes == 2


def test_several_maps_are_loaded_for_as_long_as_somebody_waits(lookup: Lookup, monkeypatch: pytest.MonkeyPatch) -> None:
    for number in range(3):
        lookup.put(f"m-{number}", segments=examples.WALLS)
    load, deadline, loaded = lookup.store.load, Deadline(), []

    def last(map_id: str) -> Any:
        loaded.append(map_id)
        deadline.cancel()
        return load(map_id)

    monkeypatch.setattr(lookup.store, "load", last)
    with pytest.raises(IndexNotReadyError):
        lookup.indexed(lookup.find_together(MapPrefix(prefix="m-"), ""), oriented=None, deadline=deadline)
    assert loaded == ["m-0"]


@pytest.mark.parametrize("across", [False, True])
def test_a_map_is_at_most_100_km_wide(across: bool) -> None:
    for width, fits in ((1e5, True), (1e5 + 0.001, False)):
        rows = np.array([[0.0, 0.0, 1.0, 0.0], [width - 1.0, 0.0, width, 0.0]])
        document = MapDocument.model_validate({"segments": (rows[:, [1, 0, 3, 2]] if across else rows).tolist()})
        with nullcontext() if fits else pytest.raises(InvalidMapError, match="extent"):
            assert outline_of(document).segments == 2
