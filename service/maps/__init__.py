"""Maps stored by id: the store, the cache of those that are indexed, and the way from a request's map to its index."""

from .cache import CachedMap, IndexCache
from .store import MapStore, Preconditions
from .tables import MapOutline, MapRecord

__all__ = ["CachedMap", "IndexCache", "MapOutline", "MapRecord", "MapStore", "Preconditions"]
