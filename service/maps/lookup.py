"""From the map of a request to its index."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import partial

import numpy as np

from association import Deadline, InvalidMapError, MapIndex
from registration import Segments

from ..parsing.parser_process import LARGE, ParserProcess
from ..parsing.reading import read_stored
from ..schemas.parts import InlineMap, MapDocument, is_oriented
from .cache import CachedMap, IndexCache
from .errors import BusyStoreError
from .records import MapOutline, MapRecord
from .store import MapStore

MAX_EXTENT = 1e5  # m
OVERHEAD = 24_000  # bytes that an index takes in addition to its arrays, however small these are
LONG_SEGMENTS = 2_000  # of a map that takes some milliseconds to be indexed, and
LONG_BYTES = 100_000  # of the document of one
INDEXED_BYTES = 400  # that a segment takes once it is indexed, about


@dataclass(frozen=True, slots=True)
class FoundMap:
    """A stored map that is to be searched.

    Attributes
    ----------
    record : MapRecord
    document : bytes, or None
        The document to be indexed; None where the map was in the cache.
    """

    record: MapRecord
    document: bytes | None


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

    def find(self, map_id: str, *, oriented: bool | None) -> FoundMap:
        """Look a stored map up, with its document where it is not indexed yet; runs in a thread that may wait.

        `oriented` None: as the map states.

        Looked up before every use, so that a change by another worker is never missed.

        Raises
        ------
        StoreError
            When no such map is stored, or it is damaged, or the store does not answer.
        """
        record = self._store.record(map_id)
        if self._cache.has((record, is_oriented(oriented, record.oriented))):
            return FoundMap(record, None)
        stored = self._store.load(map_id)
        return FoundMap(stored.record, stored.document)

    def find_at_once(self, map_id: str, *, oriented: bool | None) -> FoundMap | None:
        """Look up, without waiting for anybody, a map that is indexed; None where it takes a thread that may wait.

        As sure to notice a change as `find`.
        """
        record = self._store.record_at_once(map_id)
        if record is None or not self._cache.has((record, is_oriented(oriented, record.oriented))):
            return None
        return FoundMap(record, None)

    def takes_long(self, asked: InlineMap | FoundMap) -> bool:
        """Return whether it may take long until a map is ready to be searched."""
        if isinstance(asked, InlineMap):
            return len(asked.segments) > LONG_SEGMENTS
        return asked.document is not None and len(asked.document) > LONG_BYTES

    def indexed(self, asked: InlineMap | FoundMap, *, oriented: bool | None, deadline: Deadline) -> CachedMap:
        """Return a map ready to be searched.

        Oriented and unoriented indices of a map are different ones, each with a place of its own in the cache.
        `oriented` None: as the map states. If another request indexes the same map, wait for it until the deadline.

        Runs off the event loop.

        Raises
        ------
        StoreError
            When a stored map has left the cache since it was found, and cannot be had again; when the index that
            another builds is not there in time.
        ParserEndedError
            When the process that parses a large one ends meanwhile.
        InvalidSegmentsError, InvalidMapError
            When the map of the request cannot be searched.
        """
        if isinstance(asked, FoundMap):
            directed = is_oriented(oriented, asked.record.oriented)
            return self._cache.get((asked.record, directed), partial(self._read, asked, directed), deadline)
        # Robots send the same map with every scan: its content is its name.
        digest = hashlib.sha256(asked.segments.tobytes()).hexdigest()
        directed = is_oriented(oriented, asked.oriented)
        key = digest, asked.sigma, asked.frame_id, directed
        return self._cache.get(key, lambda: self._index(asked, directed), deadline)

    def index_once(self, asked: InlineMap, deadline: Deadline) -> MapIndex:
        """Return the index, with its directions, of a map that is not searched; it is not cached.

        Raises
        ------
        InvalidSegmentsError, InvalidMapError
            When the map cannot be searched.
        IndexingEndedError
            When the deadline passes, or is cancelled, first.
        """
        self._cache.make_room(INDEXED_BYTES * len(asked.segments))
        segments = Segments.from_array(asked.segments, argument="map.segments")
        return MapIndex.build(segments, asked.sigma, deadline=deadline)

    def _read(self, found: FoundMap, oriented: bool) -> CachedMap:
        document = found.document
        if document is None:
            stored = self._store.load(found.record.map_id)
            if stored.record != found.record:
                raise BusyStoreError  # changed since, and out of the cache meanwhile
            document = stored.document
        if len(document) > LARGE:
            return self._index(self._parser.call(read_stored, document), oriented)
        return self._index(read_stored(document), oriented)

    def _index(self, asked: InlineMap | MapDocument, oriented: bool) -> CachedMap:
        # The old goes before the new comes: two of the largest at once would take too much.
        self._cache.make_room(INDEXED_BYTES * len(asked.segments) * (1 if oriented else 2))
        segments = Segments.from_array(asked.segments, argument="map.segments")
        index = MapIndex.build(segments, asked.sigma, oriented=oriented)
        return CachedMap(index, asked.frame_id, index.nbytes + OVERHEAD)


def outline_of(document: MapDocument) -> MapOutline:
    """Return the outline of a map that is to be stored.

    Raises
    ------
    InvalidSegmentsError, InvalidMapError
        When it could not be searched.
    """
    segments = Segments.from_array(document.segments, argument="segments")
    if len(segments) == 0:
        raise InvalidMapError("expected at least one segment, found none", argument="segments")
    corners = segments.endpoints.reshape(-1, 2)
    if np.ptp(corners, axis=0).max() > MAX_EXTENT:
        raise InvalidMapError(
            f"expected an extent of at most {MAX_EXTENT:g} m, found more; check the unit", argument="segments"
        )
    # No negative zeros: not every database keeps them.
    low, high = (corners.min(axis=0) + 0.0).tolist(), (corners.max(axis=0) + 0.0).tolist()
    return MapOutline(len(segments), (low[0], low[1], high[0], high[1]), document.sigma, document.oriented)
