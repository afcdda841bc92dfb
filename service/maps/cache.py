"""Indexed maps in memory: bounded in bytes, least recently used out first, one build per map at a time."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Hashable
from concurrent.futures import Future, wait
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..errors import IndexNotReadyError
from ..telemetry.metrics import Metrics

if TYPE_CHECKING:  # the store comes without what computes
    from association import Deadline, MapIndex, MapSet

ALONE = 2  # times the cache; the largest map takes that where its directions mean nothing
LOOK_SECONDS = 0.05  # between two checks, while waiting for another's index, that the own client is still there


@dataclass(frozen=True, slots=True)
class CachedMap:
    """An indexed map, or several that are indexed together.

    Attributes
    ----------
    maps : MapIndex or MapSet
    bytes : int
    """

    maps: MapIndex | MapSet
    bytes: int


class IndexCache:
    """Builds missing indices; callers that want the same map wait for one build.

    Keys name content, not maps: a map that changes gets another key, so that nothing stale is ever found.
    """

    def __init__(self, max_bytes: int, metrics: Metrics) -> None:
        self._max_bytes = max_bytes
        self._metrics = metrics
        self._lock = threading.RLock()
        self._ready: OrderedDict[Hashable, CachedMap] = OrderedDict()
        self._building: dict[Hashable, Future[CachedMap]] = {}
        self.bytes = 0

    def __len__(self) -> int:
        return len(self._ready)

    def has(self, key: Hashable) -> bool:
        """Return whether a map is there."""
        with self._lock:
            return key in self._ready

    def find(self, key: Hashable) -> CachedMap | None:
        """Return a map, or maps; None where they are not there."""
        with self._lock:
            found = self._ready.get(key)
            if found is not None:
                self._ready.move_to_end(key)
                self._metrics.cache_hits.inc()
            return found

    def get(self, key: Hashable, build: Callable[[], CachedMap], deadline: Deadline) -> CachedMap:
        """Return the map, or the maps, of a key, built by this caller or by the first one that requested it.

        Raises
        ------
        IndexNotReadyError
            When the deadline passes, or is cancelled, while the first caller still builds it.
        """
        with self._lock:
            found = self.find(key)
            if found is not None:
                return found
            promise = self._building.get(key)
            if promise is None:
                self._building[key] = Future()
        try:
            if promise is not None:
                return _awaited(promise, deadline)
        finally:
            del promise  # its error holds this frame: in a cycle, the map would stay until the next collection
        self._metrics.cache_misses.inc()
        return self._build(key, build)

    def make_room(self, size: int) -> None:
        """Drop the maps used the longest ago until so much more would fit; before something large is built."""
        with self._lock:
            self._drop_until(self._max_bytes - size)

    def _build(self, key: Hashable, build: Callable[[], CachedMap]) -> CachedMap:
        try:
            made = build()
        except BaseException as error:
            self._promised(key).set_exception(error)
            raise
        with self._lock:
            promise = self._building.pop(key)
            self._keep(key, made)
        promise.set_result(made)
        return made

    def _promised(self, key: Hashable) -> Future[CachedMap]:
        """Return what those wait for who want a map that is not built any more."""
        with self._lock:
            return self._building.pop(key)

    def _keep(self, key: Hashable, made: CachedMap) -> None:
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


def _awaited(promise: Future[CachedMap], deadline: Deadline) -> CachedMap:
    """Return the map that another thread builds, if it is there in time; the waiting thread holds a slot."""
    while not deadline.passed:
        left = LOOK_SECONDS if deadline.at is None else deadline.at - time.monotonic()
        done, _ = wait([promise], max(0.0, min(LOOK_SECONDS, left)))
        if done:
            try:
                return promise.result()
            finally:
                del promise, done  # as above
    raise IndexNotReadyError
