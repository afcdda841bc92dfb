"""Searching scans of known poses: what came of each, and how long it took.

One core, unless an engine is given; compilation is over before the clock starts.
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
from batch import Engine, Lost
from registration import RigidTransform, wrap_angle

from .collection import Collection, MapKey, Query, building

OPTIONS = AssociationOptions(max_alternatives=20)
SEED = 20190901
WARM_UP = 6  # searches that do not count
PIECE = 60  # queries that a worker of an engine does at a time


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


def run(
    collection: Collection,
    *,
    steps: bool = False,
    key: Callable[[Query], MapKey] | None = None,
    engine: Engine | None = None,
) -> list[Outcome]:
    """Search all scans of a collection, in this process or on an engine.

    `key` names the map to search for each where it is not its own.
    """
    keys = [key(query) if key else query.map for query in collection.queries]
    whole = Piece(collection, tuple(keys), steps)
    if engine is None:
        return searched(whole)
    pieces = whole.pieces()
    done: dict[int, list[Outcome] | Lost] = dict.fromkeys(range(len(pieces)), Lost())
    for (number, _), outcomes in engine.run(_searched_numbered, list(enumerate(pieces))):
        done[number] = outcomes
        progress(collection.name, number + 1, len(pieces))
    found = []
    for outcomes in done.values():
        if isinstance(outcomes, Lost):
            raise RuntimeError(f"{collection.name}: a part of it ended every worker that had it")
        found += outcomes
    return found


@dataclass(frozen=True)
class Piece:
    """Some queries of a collection, the map that each is searched in, and whether the search step is timed apart."""

    collection: Collection
    keys: tuple[MapKey, ...]
    steps: bool

    def pieces(self) -> list[Piece]:
        """Cut it into what one worker does at a time, each with no more maps than it needs."""
        found = []
        for begin in range(0, len(self.keys), PIECE):
            keys, queries = self.keys[begin : begin + PIECE], self.collection.queries[begin : begin + PIECE]
            maps = {key: self.collection.maps[key] for key in keys}
            whole = self.collection
            some = Collection(whole.name, maps, queries, whole.distance, whole.angle)
            found.append(Piece(some, keys, self.steps))
        return found


def searched(piece: Piece) -> list[Outcome]:
    """Search the scans of a piece, after some that do not count."""
    outcomes, queries = [], piece.collection.queries
    for query, key in zip(queries[:WARM_UP], piece.keys[:WARM_UP], strict=True):
        run_one(piece.collection, query, key, steps=piece.steps)
    for k, (query, key) in enumerate(zip(queries, piece.keys, strict=True)):
        outcomes.append(run_one(piece.collection, query, key, steps=piece.steps))
        progress(piece.collection.name, k + 1, len(queries))
    return outcomes


def _searched_numbered(item: tuple[int, Piece]) -> list[Outcome]:
    return searched(item[1])


def other_map(collection: Collection) -> list[MapKey]:
    """Draw for every query the map of another building of its family, by seed."""
    rng = np.random.default_rng(SEED)
    others = {
        here: [k for k in collection.maps if k[0] == here[0] and building(k) != building(here)]
        for here in {q.map for q in collection.queries}
    }
    return [others[q.map][rng.integers(len(others[q.map]))] for q in collection.queries]


def strangers(collection: Collection, engine: Engine | None = None) -> list[Outcome]:
    """Search every scan in the map of another building."""
    chosen = dict(zip(map(id, collection.queries), other_map(collection), strict=True))
    return run(collection, key=lambda query: chosen[id(query)], engine=engine)


def other_logs(collections: Sequence[Collection], engine: Engine | None = None) -> list[Outcome]:
    """Search every fourth scan of each log in the map of the next one."""
    outcomes = []
    for k, log in enumerate(collections):
        other = collections[(k + 1) % len(collections)]
        away = Collection(f"{log.name} in {other.name}", other.maps, log.queries[::4], log.distance, log.angle)
        outcomes += _run_in(away, next(iter(other.maps)), engine)
    return outcomes


def _run_in(collection: Collection, key: MapKey, engine: Engine | None) -> list[Outcome]:
    return run(collection, key=lambda _query: key, engine=engine)


def progress(name: str, done: int, total: int) -> None:
    """Tell on standard error how far a run is, now and then."""
    if sys.stderr.isatty() or done == total:
        print(f"\r{name}: {done} of {total}", end="\n" if done == total else "", file=sys.stderr, flush=True)
