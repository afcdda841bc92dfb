"""Indexed maps in memory."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import URL

from association import MapIndex
from registration import Segments
from service.maps import CachedMap, IndexCache, MapStore
from service.maps.lookup import MapLookup
from service.parsing.parser_process import ParserProcess
from service.schemas import examples
from service.schemas.encoding import NotFiniteError, encode
from service.schemas.parts import InlineMap
from service.telemetry.metrics import Metrics

INDEX = MapIndex.build(Segments.from_array([[0.0, 0.0, 1.0, 0.0]]), 0.0)


def a_map(size: int) -> CachedMap:
    return CachedMap(INDEX, "map", size)


def test_the_least_recently_used_goes_first() -> None:
    cache = IndexCache(100, Metrics())
    for name in "abc":
        cache.get(name, lambda: a_map(30))
    cache.get("a", lambda: pytest.fail("is there"))
    cache.get("d", lambda: a_map(30))
    assert (len(cache), cache.bytes) == (3, 90)
    cache.get("a", lambda: pytest.fail("is there"))
    built = []
    cache.get("b", lambda: built.append("b") or a_map(30))
    assert built == ["b"]


def test_room_is_made_before_something_is_built() -> None:
    cache = IndexCache(100, Metrics())
    for name in "abc":
        cache.get(name, lambda: a_map(30))
    cache.make_room(40)
    assert (len(cache), cache.bytes) == (2, 60)
    cache.get("c", lambda: pytest.fail("is there"))
    cache.make_room(1000)
    assert (len(cache), cache.bytes) == (0, 0)


def test_what_is_too_large_is_used_and_not_kept() -> None:
    cache = IndexCache(10, Metrics())
    assert cache.get("a", lambda: a_map(30)).bytes == 30
    assert (len(cache), cache.bytes) == (0, 0)


def test_callers_at_the_same_time_share_one_build() -> None:
    cache = IndexCache(100, Metrics())
    release, builds = threading.Event(), []

    def build() -> CachedMap:
        builds.append(1)
        release.wait(10)
        return a_map(1)

    with ThreadPoolExecutor(4) as threads:
        asked = [threads.submit(cache.get, "a", build) for _ in range(4)]
        release.set()
        answers = [one.result(10) for one in asked]
    assert len(builds) == 1
    assert all(answer is answers[0] for answer in answers)


def test_a_failed_build_is_not_remembered() -> None:
    cache = IndexCache(100, Metrics())
    with pytest.raises(ZeroDivisionError):
        cache.get("a", lambda: 1 // 0)  # type: ignore[arg-type, return-value]
    assert cache.get("a", lambda: a_map(1)).bytes == 1


def test_a_map_without_directions_is_another_one_in_the_cache(tmp_path: Path) -> None:
    cache = IndexCache(10_000_000, Metrics())
    lookup = MapLookup(cache, MapStore(URL.create("sqlite", database=str(tmp_path / "maps"))), ParserProcess())
    asked = InlineMap.model_validate({"segments": examples.WALLS}, context={"map_segments": 10})
    one, other, again = (lookup.indexed(asked, oriented=oriented)[0] for oriented in (True, False, True))
    assert len(other.index.segments) == 2 * len(one.index.segments)
    assert again is one
    assert cache.bytes == one.index.nbytes + other.index.nbytes
    assert other.index.undirected is other.index


@pytest.mark.parametrize("answer", [np.nan, {"a": [1.0, {"b": np.inf}]}, {"a": np.array([[1.0, -np.inf]])}, (np.nan,)])
def test_nothing_that_is_not_finite_leaves(answer: object) -> None:
    with pytest.raises(NotFiniteError):
        encode(answer)
    assert encode({"a": np.array([1.0]), "b": None}) == b'{"a":[1.0],"b":null}'
