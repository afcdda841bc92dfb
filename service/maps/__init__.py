"""Maps kept by id: the store, and the cache of those that are indexed."""

from .cache import CachedMap, IndexCache
from .store import MapRecord, MapStore, MapSummary, Preconditions, StoredMap

__all__ = ["CachedMap", "IndexCache", "MapRecord", "MapStore", "MapSummary", "Preconditions", "StoredMap"]
