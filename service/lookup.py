"""From the map of a request to its index."""

from __future__ import annotations

import hashlib
from functools import partial

import numpy as np
import orjson

from association import InvalidMapError, MapIndex
from registration import Segments

from .maps import CachedMap, IndexCache, MapRecord, MapStore
from .schemas.parts import InlineMap, StoredMap
from .schemas.requests import MapDocument

MAX_EXTENT = 1e5  # m


def indexed_map(asked: InlineMap | StoredMap, cache: IndexCache, store: MapStore) -> tuple[CachedMap, int | None]:
    """Return a map ready to be searched, and its revision where it is a stored one.

    Runs off the event loop.

    Raises
    ------
    ProblemError
        When no such map is stored, or it is damaged, or the store does not answer.
    InvalidSegmentsError, InvalidMapError
        When the map of the request cannot be searched.
    """
    if isinstance(asked, InlineMap):
        # Robots send the same map with every scan: what is in it names it.
        digest = hashlib.sha256(asked.segments.tobytes()).hexdigest()
        return cache.get((digest, asked.sigma, asked.frame_id), lambda: _index(asked)), None
    while True:
        # Looked up before every use, so that a change by another worker is never missed.
        record = store.record(asked.map_id)
        try:
            return cache.get(record, partial(_load, record, store)), record.revision
        except _ChangedError:
            continue


def checked_segments(document: MapDocument) -> Segments:
    """Return the segments of a map that is to be stored, after the checks that indexing it would make.

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
    return segments


class _ChangedError(Exception):
    """The map was changed between the look at its revision and its loading."""


def _load(record: MapRecord, store: MapStore) -> CachedMap:
    stored = store.load(record.map_id)
    if stored.record != record:
        raise _ChangedError
    return _index(MapDocument.model_validate(orjson.loads(stored.document)))


def _index(asked: InlineMap | MapDocument) -> CachedMap:
    segments = Segments.from_array(asked.segments, argument="map.segments")
    index = MapIndex.build(segments, asked.sigma)
    return CachedMap(index, asked.frame_id, index.nbytes)
