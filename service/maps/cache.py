"""Indexed maps in memory: bounded in bytes, least recently used out first, one build per map at a time."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from concurrent.futures import Future, wait
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from ..telemetry.metrics import Metrics
from .errors import IndexNotReadyError

if TYPE_CHECKING:  # the store comes without what computes
    from association import Deadline, MapIndex, MapSet

ALONE = 2  # times the cache; the largest map takes that where its directions mean nothing
LOOK_SECONDS = 0.05  # between two checks, while waiting for another's index, that the own client is still there


@dataclass(frozen=True, slots=True)
class CachedMap:
    """An indexed map with the frame that its poses are in."""

    index: MapIndex
    frame_id: str
    bytes: int

    @property
    def oriented(self) -> bool:
        """Return whether directions of its segments mean anything; else the index lists each segment both ways."""
        return len(self.index.segments) == self.index.directed


@dataclass(frozen=True, slots=True)
class CachedMaps:
    """Several maps that are indexed together, with the frames that their poses are in."""

    maps: MapSet
    frame_ids: tuple[str, ...]
    bytes: int


Cached = CachedMap | CachedMaps
C = TypeVar("C", CachedMap, CachedMaps)


class IndexCache:
    """Builds missing indices; callers that want the same map wait for one build.

    Keys name content, not maps: a map that changes gets another key, so that nothing stale is ever found.
    """

    def __init__(self, max_bytes: int, metrics: Metrics) -> None:
        self._max_bytes = max_bytes
        self._metrics = metrics
        self._lock = threading.Lock()
        self._ready: OrderedDict[Hashable, Cached] = OrderedDict()
        self._building: dict[Hashable, Future[Any]] = {}
        self.bytes = 0

    def __len__(self) -> int:
        return len(self._ready)

    def has(self, key: Hashable) -> bool:
        """Return whether a map is there."""
        with self._lock:
            return key in self._ready

    def get(self, key: Hashable, build: Callable[[], C], deadline: Deadline) -> C:
        """Return the map, or the maps, of a key, built by this caller or by the first one that requested it.

        Raises
        ------
        IndexNotReadyError
            When the deadline passes, or is cancelled, while the first caller still builds it.
        """
        with self._lock:
            found = self._ready.get(key)
            if found is not None:
                self._ready.move_to_end(key)
                self._metrics.cache_hits.inc()
                return found  # type: ignore[return-value]  # a key is of one kind
            promise = self._building.get(key)
            mine = promise is None
            if promise is None:
                promise = self._building[key] = Future()
        if not mine:
            made: C = _awaited(promise, deadline)
            return made
        self._metrics.cache_misses.inc()
        return self._build(key, promise, build)

    def make_room(self, size: int) -> None:
        """Drop the maps used the longest ago until so much more would fit; before something large is built."""
        with self._lock:
            self._drop_until(self._max_bytes - size)

    def _build(self, key: Hashable, promise: Future[Any], build: Callable[[], C]) -> C:
        try:
            made = build()
        except BaseException as error:
            with self._lock:
                del self._building[key]
            promise.set_exception(error)
            raise
        with self._lock:
            del self._building[key]
            self._keep(key, made)
        promise.set_result(made)
        return made

    def _keep(self, key: Hashable, made: Cached) -> None:
        """Keep a map; one that is larger than the cache, by up to as much again, alone and until the next comes.

        It takes as much whenever it is built: to do so for each request would need no less memory.
        """
        if made.bytes > ALONE * self._max_bytes:
            return
        self._drop_until(self._max_bytes - made.bytes)
        self._ready[key] = made
        self.bytes += made.bytes

    def _drop_until(self, most: int) -> None:
        while self._ready and self.bytes > most:
            _, dropped = self._ready.popitem(last=False)
            self.bytes -= dropped.bytes


def _awaited(promise: Future[C], deadline: Deadline) -> C:
    """Return the map that another thread builds, if it is there in time; the waiting thread holds a slot."""
    while not deadline.passed:
        left = LOOK_SECONDS if deadline.at is None else deadline.at - time.monotonic()
        done, _ = wait([promise], max(0.0, min(LOOK_SECONDS, left)))
        if done:
            return promise.result()
    raise IndexNotReadyError
