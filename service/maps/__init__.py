"""Maps stored by id: the store, the cache of those that are indexed, and the way from a request's map to its index."""

from .cache import CachedMap, IndexCache
from .store import EVERY_REVISION, MapStore, Preconditions
from .tables import MapOutline, MapRecord

__all__ = ["EVERY_REVISION", "CachedMap", "IndexCache", "MapOutline", "MapRecord", "MapStore", "Preconditions"]
