"""From the map of a request to its index."""

from __future__ import annotations

import hashlib
from functools import partial

import numpy as np

from association import InvalidMapError, MapIndex
from registration import Segments

from ..parsing.parser_process import LARGE, ParserProcess
from ..parsing.reading import read_stored
from ..schemas.parts import InlineMap, StoredMap
from ..schemas.requests import MapDocument
from .cache import CachedMap, IndexCache
from .records import Bounds, MapRecord
from .store import MapStore

MAX_EXTENT = 1e5  # m
INDEXED_BYTES = 400  # that a segment takes once it is indexed, about


class MapLookup:
    """Finds the map that a request names or holds, indexed.

    Parameters
    ----------
    cache : IndexCache
    store : MapStore
    parser : ParserProcess
        Parses large stored maps.
    """

    def __init__(self, cache: IndexCache, store: MapStore, parser: ParserProcess) -> None:
        self._cache = cache
        self._store = store
        self._parser = parser

    def indexed(self, asked: InlineMap | StoredMap, *, oriented: bool) -> tuple[CachedMap, int | None]:
        """Return a map ready to be searched, and its revision where it is a stored one.

        Whether its directions count makes it another index, with a place of its own in the cache.

        Runs off the event loop.

        Raises
        ------
        StoreError
            When no such map is stored, or it is damaged, or the store does not answer.
        ParserEndedError
            When the process that parses a large one ends meanwhile.
        InvalidSegmentsError, InvalidMapError
            When the map of the request cannot be searched.
        """
        if isinstance(asked, InlineMap):
            # Robots send the same map with every scan: what is in it names it.
            digest = hashlib.sha256(asked.segments.tobytes()).hexdigest()
            key = digest, asked.sigma, asked.frame_id, oriented
            return self._cache.get(key, lambda: self._index(asked, oriented)), None
        while True:
            # Looked up before every use, so that a change by another worker is never missed.
            record = self._store.record(asked.map_id)
            try:
                return self._cache.get((record, oriented), partial(self._load, record, oriented)), record.revision
            except _ChangedError:
                continue

    def _load(self, record: MapRecord, oriented: bool) -> CachedMap:
        stored = self._store.load(record.map_id)
        if stored.record != record:
            raise _ChangedError
        if len(stored.document) > LARGE:
            return self._index(self._parser.call(read_stored, stored.document), oriented)
        return self._index(read_stored(stored.document), oriented)

    def _index(self, asked: InlineMap | MapDocument, oriented: bool) -> CachedMap:
        # The old goes before the new comes: two of the largest at once would take too much.
        self._cache.make_room(INDEXED_BYTES * len(asked.segments) * (1 if oriented else 2))
        segments = Segments.from_array(asked.segments, argument="map.segments")
        index = MapIndex.build(segments, asked.sigma, oriented=oriented)
        return CachedMap(index, asked.frame_id, index.nbytes)


def summary_of(document: MapDocument) -> tuple[int, Bounds]:
    """Return the number of segments, and the bounds, of a map that is to be stored.

    Raises
    ------
    InvalidSegmentsError, InvalidMapError
        When it could not be searched.
    """
    segments = Segments.from_array(document.segments, argument="segments")
    if len(segments) == 0:
        raise InvalidMapError("a map has at least one segment", argument="segments")
    corners = segments.endpoints.reshape(-1, 2)
    if np.ptp(corners, axis=0).max() > MAX_EXTENT:
        raise InvalidMapError(f"its extent is beyond {MAX_EXTENT:g} m", argument="segments")
    # No negative zeros: not every database keeps them.
    low, high = (corners.min(axis=0) + 0.0).tolist(), (corners.max(axis=0) + 0.0).tolist()
    return len(segments), (low[0], low[1], high[0], high[1])


class _ChangedError(Exception):
    """The map was changed between the look at its revision and its loading."""
