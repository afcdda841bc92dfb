"""From the map of a request to its index."""

from __future__ import annotations

import hashlib
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from association import Deadline, IndexingEndedError, MapIndex, MapSet
from linefix.documents.errors import Fault, InvalidRequestError, TooManyError
from linefix.documents.inputs import index_of, parts_of, reference_of, require_map
from linefix.documents.parts import MOST_MAPS, InlineMap, MapDocument, MapPrefix, NamedMap, StoredMap, is_oriented
from linefix.documents.reading import read_stored

from ..errors import BusyStoreError, CorruptMapError, IndexNotReadyError, UnknownMapError
from ..parsing.child import LARGE, Child
from .cache import CachedMap, IndexCache
from .store import MapStore
from .tables import MapOutline, MapRecord

OVERHEAD = 24_000  # bytes that an index takes in addition to its arrays, however small these are
LONG_SEGMENTS = 2_000  # of a map in a request, whose content is not compared with those of others in the event loop
LONG_BYTES = 100_000  # of the document of one
MOST_TOGETHER = 200_000  # segments of several maps, and points, as of one
INDEXED_BYTES = 400  # that a segment takes once it is indexed, about


@dataclass(frozen=True, slots=True)
class FoundMaps:
    """A map that is to be searched, or several.

    Attributes
    ----------
    maps : mapping
        Those in the request, and the records of stored ones, by name; a single map by None.
    document : bytes, or None
        Of a single map that is stored; None where it was in the cache.
    """

    maps: Mapping[str | None, InlineMap | MapRecord]
    document: bytes | None = None

    @property
    def unread_bytes(self) -> int:
        """The bytes of the largest of several stored maps: one is read after another."""
        stored = (one.size for name, one in self.maps.items() if name is not None and isinstance(one, MapRecord))
        return max(stored, default=0)

    @property
    def references(self) -> dict[str | None, dict[str, object] | None]:
        """Id and revision of each map; the revision, or all of a single map, is None where it came with the request."""
        return {
            name: reference_of(one.map_id, one.revision) if isinstance(one, MapRecord) else reference_of(name)
            for name, one in self.maps.items()
        }


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

    def is_cached(self, found: FoundMaps, *, oriented: bool | None) -> bool:
        """Return whether maps are indexed already; `oriented` None: as each map states."""
        return self._cache.has(_key(found, oriented))

    def takes_long(self, found: FoundMaps) -> bool:
        """Return whether it may take long to index maps."""
        single = found.maps.get(None)
        if isinstance(single, InlineMap):
            return len(single.segments) + len(single.points) > LONG_SEGMENTS
        return single is None or (found.document is not None and len(found.document) > LONG_BYTES)

    def cached(self, found: FoundMaps, *, oriented: bool | None) -> CachedMap | None:
        """Return maps that are indexed already; None where they are not, or finding that out takes a while."""
        single = found.maps.get(None)
        if isinstance(single, InlineMap) and self.takes_long(found):
            return None
        return self._cache.find(_key(found, oriented))

    def indexed(self, found: FoundMaps, *, oriented: bool | None, deadline: Deadline) -> CachedMap:
        """Return maps ready to be searched, several by one index; runs off the event loop.

        Oriented and unoriented indices of a map are different ones, each with a place of its own in the cache.
        `oriented` None: as each map states. If another request indexes the same maps, wait for it until the deadline.
        The index of a single map that is begun is finished. Several maps are named in errors by their place, as
        ``maps.3.segments``.

        Raises
        ------
        StoreError
            When a stored map has left the cache since it was found, and cannot be had again; when the index of several
            maps, or one that another request builds, is not there in time.
        ParserEndedError
            When the process that parses a large one ends meanwhile.
        InvalidSegmentsError, InvalidMapError
            When a map of the request cannot be searched.
        """
        return self._cache.get(_key(found, oriented), partial(self._index, found, oriented, deadline), deadline)

    def find_together(self, asked: Sequence[NamedMap | StoredMap] | MapPrefix, prefix: str) -> FoundMaps:
        """Look several maps up, and count what is in them by their records; runs in a thread that may wait.

        `prefix` is that of all maps that the caller may use.

        Raises
        ------
        StoreError
            When a map is not stored, or not for this caller, or is damaged, or the store does not answer.
        InvalidRequestError
            When more maps than allowed have the prefix.
        TooManyError
            When there is more in the maps than may be searched together.
        """
        if isinstance(asked, MapPrefix):
            found: list[NamedMap | MapRecord] = [*self._beginning(asked.prefix, prefix)]
        elif any(isinstance(one, StoredMap) and not one.map_id.startswith(prefix) for one in asked):
            raise UnknownMapError
        else:
            found = [one if isinstance(one, NamedMap) else self._store.record(one.map_id) for one in asked]
        for kind in ("segments", "points"):
            if sum(_count(one, kind) for one in found) > MOST_TOGETHER:
                raise TooManyError("/maps", MOST_TOGETHER, f"{kind} of all maps together")
        return FoundMaps({one.map_id: one for one in found})

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

    def document(self, source: InlineMap | MapRecord, document: bytes | None = None) -> MapDocument:
        """Return the document of a map, stored ones by the bytes that were found; runs off the event loop.

        Raises
        ------
        StoreError
            When a stored map has changed since it was found, or cannot be had again.
        ParserEndedError
            When the process that parses a large one ends meanwhile.
        """
        if isinstance(source, InlineMap):
            return source
        if document is None:
            stored = self._store.load(source.map_id)
            if stored.record != source:
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

    def _documents(self, found: FoundMaps, deadline: Deadline) -> Iterator[tuple[str | None, MapDocument]]:
        """Yield the documents of maps by name, one after another; raises also `IndexNotReadyError`."""
        for number, (name, one) in enumerate(found.maps.items()):
            if number and deadline.passed:
                raise IndexNotReadyError
            yield name, self.document(one, found.document)

    def _index(self, found: FoundMaps, oriented: bool | None, deadline: Deadline) -> CachedMap:
        parts = parts_of(self._documents(found, deadline), oriented)
        # The old goes before the new comes: two of the largest at once would take too much.
        each = 1 if all(part.oriented for part in parts.values()) else 2
        count = sum(each * len(part.segments) + len(part.points) for part in parts.values())
        single = parts.get("")
        self._cache.make_room(INDEXED_BYTES * count * (1 if single is not None else 2))
        maps: MapIndex | MapSet
        if single is not None:
            maps = single.indexed()
        else:
            try:
                maps = MapSet(parts, deadline)
            except IndexingEndedError:
                raise IndexNotReadyError from None
        return CachedMap(maps, maps.nbytes + OVERHEAD)


def _count(one: InlineMap | MapRecord, kind: str) -> int:
    """Return the number of segments, or points, of a map."""
    return int(getattr(one.outline, kind)) if isinstance(one, MapRecord) else len(getattr(one, kind))


def _key(found: FoundMaps, oriented: bool | None) -> Hashable:
    """Return the name of the content of maps, in their order; robots send the same map with every scan."""
    return tuple(
        (name, one if isinstance(one, MapRecord) else _content(one), is_oriented(oriented, one.oriented))
        for name, one in found.maps.items()
    )


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
