"""Maps kept by id: the store, and the cache of those that are indexed."""

from .cache import CachedMap, IndexCache
from .preconditions import Preconditions
from .records import Bounds, MapPage, MapRecord, MapSummary, StoredMap
from .store import MapStore

__all__ = [
    "Bounds",
    "CachedMap",
    "IndexCache",
    "MapPage",
    "MapRecord",
    "MapStore",
    "MapSummary",
    "Preconditions",
    "StoredMap",
]
