"""Searching scans of known poses: what came of each, and how long it took.

One core; compilation is over before the clock starts.
"""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from association import AssociationOptions, AssociationResult, Deadline, associate
from association.context import SearchContext
from association.search.search import search as find_candidates
from registration import RigidTransform, wrap_angle

from .collection import Collection, MapKey, Query, building

OPTIONS = AssociationOptions(max_alternatives=20)
SEED = 20190901
WARM_UP = 6  # searches that do not count


@dataclass(frozen=True, slots=True)
class Outcome:
    """The result of a query.

    Attributes
    ----------
    query : Query
    map : MapKey
        The map of the search; that of another building for an out-of-map scan.
    result : AssociationResult
    right : bool
        The pose lies within the collection's tolerance of the truth; never in the map of another building.
    among : bool
        The pose or an alternative does.
    cpu, wall, search : float
        Milliseconds of `associate`: the thread's processor time and the time that passed; and the processor time of the
        search step alone, nan where it was not measured.
    """

    query: Query
    map: MapKey
    result: AssociationResult
    right: bool
    among: bool
    cpu: float
    wall: float
    search: float

    @property
    def usable(self) -> bool:
        """Return whether the robot would go by it."""
        return self.result.usable


def offset(pose: RigidTransform, truth: RigidTransform) -> tuple[float, float]:
    """Return how far a pose is off, metres and degrees."""
    distance = math.hypot(pose.x - truth.x, pose.y - truth.y)
    return distance, abs(math.degrees(wrap_angle(pose.theta - truth.theta)))


def is_right(pose: RigidTransform | None, truth: RigidTransform, collection: Collection) -> bool:
    """Tell whether a pose is near enough to the truth."""
    if pose is None:
        return False
    distance, angle = offset(pose, truth)
    return distance < collection.distance and angle < collection.angle


def run_one(collection: Collection, query: Query, key: MapKey | None = None, *, steps: bool = False) -> Outcome:
    """Search one scan, in its own map or in another; with `steps` the search step is timed apart."""
    index, scan = collection.index(key or query.map), query.scan
    began = time.perf_counter(), time.thread_time()
    result = associate(index, scan, None, OPTIONS)
    wall, cpu = time.perf_counter() - began[0], time.thread_time() - began[1]
    search = math.nan
    if steps:
        context = SearchContext.of(index, scan, None, OPTIONS, Deadline())
        start = time.thread_time()
        find_candidates(context)
        search = 1e3 * (time.thread_time() - start)
    own = key is None or key == query.map  # in the map of another building nothing is right
    right = own and is_right(result.pose, query.pose, collection)
    among = right or (own and any(is_right(a.pose, query.pose, collection) for a in result.alternatives))
    return Outcome(query, key or query.map, result, right, among, 1e3 * cpu, 1e3 * wall, search)


def run(collection: Collection, *, steps: bool = False, key: Callable[[Query], MapKey] | None = None) -> list[Outcome]:
    """Search all scans of a collection, after some that do not count.

    `key` names the map to search for each where it is not its own.
    """
    outcomes, queries = [], collection.queries
    keys = [key(query) if key else query.map for query in queries]
    for query, place in zip(queries[:WARM_UP], keys[:WARM_UP], strict=True):
        run_one(collection, query, place, steps=steps)
    for k, (query, place) in enumerate(zip(queries, keys, strict=True)):
        outcomes.append(run_one(collection, query, place, steps=steps))
        progress(collection.name, k + 1, len(queries))
    return outcomes


def other_map(collection: Collection) -> list[MapKey]:
    """Draw for every query the map of another building of its family, by seed."""
    rng = np.random.default_rng(SEED)
    others = {
        here: [k for k in collection.maps if k[0] == here[0] and building(k) != building(here)]
        for here in {q.map for q in collection.queries}
    }
    return [others[q.map][rng.integers(len(others[q.map]))] for q in collection.queries]


def strangers(collection: Collection) -> list[Outcome]:
    """Search every scan in the map of another building."""
    chosen = dict(zip(map(id, collection.queries), other_map(collection), strict=True))
    return run(collection, key=lambda query: chosen[id(query)])


def other_logs(collections: Sequence[Collection]) -> list[Outcome]:
    """Search every fourth scan of each log in the map of the next one."""
    outcomes = []
    for k, log in enumerate(collections):
        other = collections[(k + 1) % len(collections)]
        away = Collection(f"{log.name} in {other.name}", other.maps, log.queries[::4], log.distance, log.angle)
        place = next(iter(other.maps))
        outcomes += run(away, key=lambda _query, place=place: place)  # type: ignore[misc]
    return outcomes


def progress(name: str, done: int, total: int) -> None:
    """Tell on standard error how far a run is, now and then."""
    if sys.stderr.isatty() or done == total:
        print(f"\r{name}: {done} of {total}", end="\n" if done == total else "", file=sys.stderr, flush=True)
