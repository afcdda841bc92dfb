"""From the map of a request to its index."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import partial

from association import Deadline, IndexingEndedError, MapIndex, MapSet
from linefix.documents.errors import Fault, InvalidRequestError, TooManyError
from linefix.documents.inputs import index_of, part_of, require_map
from linefix.documents.parts import InlineMap, MapDocument, StoredMap, is_oriented
from linefix.documents.reading import read_stored
from linefix.documents.several import MOST_MAPS, MapPrefix, NamedMap

from ..parsing.child import LARGE, Child
from .cache import CachedMap, CachedMaps, IndexCache
from .errors import BusyStoreError, CorruptMapError, IndexNotReadyError, UnknownMapError
from .store import MapStore
from .tables import MapOutline, MapRecord

OVERHEAD = 24_000  # bytes that an index takes in addition to its arrays, however small these are
LONG_SEGMENTS = 2_000  # of a map that takes some milliseconds to be indexed, and
LONG_BYTES = 100_000  # of the document of one
MOST_TOGETHER = 200_000  # segments of several maps, and points, as of one
INDEXED_BYTES = 400  # that a segment takes once it is indexed, about


@dataclass(frozen=True, slots=True)
class FoundMap:
    """A stored map that is to be searched; its document is None where the map was in the cache."""

    record: MapRecord
    document: bytes | None


@dataclass(frozen=True, slots=True)
class FoundMaps:
    """Several maps that are to be searched, by name: those in the request, and the records of stored ones."""

    maps: tuple[tuple[str, InlineMap | MapRecord], ...]

    @property
    def largest_document(self) -> int:
        """The bytes of the largest stored map: one is read after another."""
        return max((one.size for _, one in self.maps if isinstance(one, MapRecord)), default=0)

    def reference_to(self, map_id: str) -> dict[str, object]:
        """Return id and revision of a map; the revision is None where the map came with the request."""
        one = dict(self.maps)[map_id]
        return {"map_id": map_id, "revision": one.revision if isinstance(one, MapRecord) else None}


class MapLookup:
    """Finds the map that a request names or holds, indexed.

    A stored map is looked up before every use, so that a change by another process is never missed.

    Parameters
    ----------
    cache : IndexCache
    store : MapStore
    parser : Child
        Parses large stored maps.
    """

    def __init__(self, cache: IndexCache, store: MapStore, parser: Child) -> None:
        self._cache = cache
        self._store = store
        self._parser = parser

    def is_cached(self, record: MapRecord, *, oriented: bool | None) -> bool:
        """Return whether a stored map is indexed; `oriented` None: as the map states."""
        return self._cache.has((record, is_oriented(oriented, record.oriented)))

    def takes_long(self, asked: InlineMap | FoundMap) -> bool:
        """Return whether it may take long until a map is ready to be searched."""
        if isinstance(asked, InlineMap):
            return len(asked.segments) + len(asked.points) > LONG_SEGMENTS
        return asked.document is not None and len(asked.document) > LONG_BYTES

    def indexed(self, asked: InlineMap | FoundMap, *, oriented: bool | None, deadline: Deadline) -> CachedMap:
        """Return a map ready to be searched; runs off the event loop.

        Oriented and unoriented indices of a map are different ones, each with a place of its own in the cache.
        `oriented` None: as the map states. If another request indexes the same map, wait for it until the deadline.

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
            key: Hashable = asked.record, directed
            return self._cache.get(key, lambda: self._index(self.document(asked), directed), deadline)
        # Robots send the same map with every scan: its content is its name.
        directed = is_oriented(oriented, asked.oriented)
        return self._cache.get((*_content(asked), directed), lambda: self._index(asked, directed), deadline)

    def find_together(self, asked: Sequence[NamedMap | StoredMap] | MapPrefix, prefix: str) -> FoundMaps:
        """Look several maps up, and count what is in them by their records; runs in a thread that may wait.

        `prefix` is that of all maps that the caller may use.

        Raises
        ------
        StoreError
            When a map is not stored, or is damaged, or the store does not answer.
        InvalidRequestError
            When more maps than allowed have the prefix.
        TooManyError
            When there is more in the maps than may be searched together.
        """
        if isinstance(asked, MapPrefix):
            found = FoundMaps(tuple((one.map_id, one) for one in self._beginning(asked.prefix, prefix)))
        else:
            records = (one if isinstance(one, NamedMap) else self._store.record(one.map_id) for one in asked)
            found = FoundMaps(tuple((one.map_id, one) for one in records))
        for kind in ("segments", "points"):
            if sum(_count(one, kind) for _, one in found.maps) > MOST_TOGETHER:
                raise TooManyError("/maps", MOST_TOGETHER, f"{kind} of all maps together")
        return found

    def are_cached(self, asked: FoundMaps, *, oriented: bool | None) -> bool:
        """Return whether several maps are indexed together already."""
        return self._cache.has(_key_together(asked, oriented))

    def indexed_together(self, asked: FoundMaps, *, oriented: bool | None, deadline: Deadline) -> CachedMaps:
        """Return several maps ready to be searched together, by one index.

        Runs off the event loop; raises as `indexed`, and `IndexNotReadyError` when the deadline passes first. Inline
        maps are named in errors by their place, as ``maps.3.segments``.
        """
        return self._cache.get(
            _key_together(asked, oriented), partial(self._index_together, asked, oriented, deadline), deadline
        )

    def index_once(self, asked: InlineMap, deadline: Deadline) -> MapIndex:
        """Return the index, with its directions, of a map that is not searched; it is not cached.

        Raises
        ------
        InvalidSegmentsError, InvalidMapError
            When the map cannot be searched.
        IndexingEndedError
            When the deadline passes, or is cancelled, first.
        """
        self._cache.make_room(INDEXED_BYTES * (len(asked.segments) + len(asked.points)))
        return index_of(asked, oriented=True, deadline=deadline)

    def document(self, found: FoundMap) -> MapDocument:
        """Return the document of a stored map; runs off the event loop.

        Raises
        ------
        StoreError
            When it has changed since it was found, or cannot be had again.
        ParserEndedError
            When the process that parses a large one ends meanwhile.
        """
        document = found.document
        if document is None:
            stored = self._store.load(found.record.map_id)
            if stored.record != found.record:
                raise BusyStoreError  # changed since, and out of the cache meanwhile
            document = stored.document
        if len(document) > LARGE:
            return self._parser.call(read_stored, document)
        return read_stored(document)

    def _beginning(self, *prefixes: str) -> list[MapRecord]:
        """Return the records of all maps whose ids begin with both prefixes."""
        shorter, longer = sorted(prefixes, key=len)
        if not longer.startswith(shorter):
            raise UnknownMapError
        page = self._store.list(MOST_MAPS, "", longer)
        if page.corrupt:
            raise CorruptMapError
        if page.next is not None:
            message = f"found more than {MOST_MAPS} maps, expected at most that many; send a longer prefix"
            raise InvalidRequestError([Fault("/maps/prefix", message)])
        if not page.maps:
            raise UnknownMapError
        return page.maps

    def _index_together(self, asked: FoundMaps, oriented: bool | None, deadline: Deadline) -> CachedMaps:
        parts, frame_ids = {}, []
        for number, (name, one) in enumerate(asked.maps):
            if deadline.passed:
                raise IndexNotReadyError
            document = one if isinstance(one, InlineMap) else self.document(FoundMap(one, None))
            directed = is_oriented(oriented, document.oriented)
            parts[name] = part_of(document, oriented=directed, path=f"maps.{number}.")
            frame_ids.append(document.frame_id)
        count = sum(len(part.segments) + len(part.points) for part in parts.values())
        self._cache.make_room(2 * INDEXED_BYTES * count)
        try:
            maps = MapSet(parts, deadline)
        except IndexingEndedError:
            raise IndexNotReadyError from None
        return CachedMaps(maps, tuple(frame_ids), maps.nbytes + OVERHEAD)

    def _index(self, asked: InlineMap | MapDocument, oriented: bool) -> CachedMap:
        # The old goes before the new comes: two of the largest at once would take too much.
        self._cache.make_room(INDEXED_BYTES * (len(asked.segments) * (1 if oriented else 2) + len(asked.points)))
        index = index_of(asked, oriented=oriented)
        return CachedMap(index, asked.frame_id, index.nbytes + OVERHEAD)


def _count(one: InlineMap | MapRecord, kind: str) -> int:
    """Return the number of segments, or points, of a map."""
    return int(getattr(one.outline, kind)) if isinstance(one, MapRecord) else len(getattr(one, kind))


def _key_together(asked: FoundMaps, oriented: bool | None) -> Hashable:
    """Return the name of the content of several maps, in their order."""
    parts = (
        (name, one) if isinstance(one, MapRecord) else (name, *_content(one), one.oriented) for name, one in asked.maps
    )
    return ("together", oriented, *parts)


def _content(asked: InlineMap) -> tuple[Hashable, ...]:
    """Return what an index and its answers depend on, in addition to whether directions mean anything."""
    segments, points = (hashlib.sha256(rows.tobytes()).hexdigest() for rows in (asked.segments, asked.points))
    return segments, asked.sigma, points, asked.points_sigma, asked.frame_id


def outline_of(document: MapDocument) -> MapOutline:
    """Return the outline of a map that is to be stored.

    Raises
    ------
    InvalidSegmentsError, InvalidMapError
        When it could not be searched.
    """
    # No negative zeros: not every database keeps them.
    (left, bottom), (right, top) = ((corner + 0.0).tolist() for corner in require_map(document))
    counts = len(document.segments), len(document.points)
    return MapOutline(*counts, (left, bottom, right, top), document.sigma, document.oriented)
