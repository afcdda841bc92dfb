"""Maps stored by id: the store, the cache of those that are indexed, and the way from a request's map to its index."""

from .cache import CachedMap, IndexCache
from .preconditions import Preconditions
from .records import Bounds, MapOutline, MapPage, MapRecord, MapSummary, StoredMap
from .several import CachedMaps, FoundMaps
from .store import MapStore

__all__ = [
    "Bounds",
    "CachedMap",
    "CachedMaps",
    "FoundMaps",
    "IndexCache",
    "MapOutline",
    "MapPage",
    "MapRecord",
    "MapStore",
    "MapSummary",
    "Preconditions",
    "StoredMap",
]
