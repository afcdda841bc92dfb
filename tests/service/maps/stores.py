"""Stores opened for a test, and changed behind their back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import orjson
from sqlalchemy import Engine, event, text

from association import Deadline
from linefix.documents import examples
from linefix.documents.parts import InlineMap, StoredMap
from service.database_location import database_url
from service.maps import CachedMap, IndexCache, MapOutline, MapRecord, MapStore
from service.maps.database import open_engine
from service.maps.lookup import FoundMaps, MapLookup
from service.parsing.child import Child
from service.telemetry.metrics import Metrics

BOX = MapOutline(4, 0, (0.0, 0.0, 1.0, 1.0))


@contextmanager
def opened(url: str, most_bytes: int | None = None) -> Iterator[MapStore]:
    store = MapStore(database_url(url), most_bytes=most_bytes)
    try:
        store.open()
        yield store
    finally:
        store.close()


@contextmanager
def engine_of(url: str) -> Iterator[Engine]:
    engine = open_engine(database_url(url))
    try:
        yield engine
    finally:
        engine.dispose()


def alter(url: str, statement: str, **values: object) -> None:
    """Change the database behind the store's back."""
    with engine_of(url) as engine, engine.begin() as connection:
        assert connection.execute(text(statement), values).rowcount > 0


@contextmanager
def on_every(name: str, function: Callable[..., None]) -> Iterator[None]:
    """Have SQLAlchemy call a function at every event of a kind, whatever the engine."""
    event.listen(Engine, name, function)
    try:
        yield
    finally:
        event.remove(Engine, name, function)


class Lookup(MapLookup):
    """A lookup with what it looks in; the fixture `lookup` closes it."""

    def __init__(self, folder: Path) -> None:
        self.cache = IndexCache(10_000_000, Metrics())
        self.store = MapStore(database_url(f"sqlite:///{folder / 'maps.sqlite3'}"))
        self.parser = Child()
        super().__init__(self.cache, self.store, self.parser)

    def look(self, asked: InlineMap | StoredMap, *, oriented: bool | None) -> tuple[CachedMap, int | None]:
        """Find and index, as for one request."""
        if isinstance(asked, InlineMap):
            return self.indexed(FoundMaps({None: asked}), oriented=oriented, deadline=Deadline()), None
        found = self.find(asked.map_id, oriented=oriented)
        record = found.maps[None]
        assert isinstance(record, MapRecord)
        return self.indexed(found, oriented=oriented, deadline=Deadline()), record.revision

    def find(self, map_id: str, *, oriented: bool | None) -> FoundMaps:
        """Find a stored map, with its document where it is not indexed."""
        found = FoundMaps({None: self.store.record(map_id)})
        if self.is_cached(found, oriented=oriented):
            return found
        stored = self.store.load(map_id)
        return FoundMaps({None: stored.record}, stored.document)

    def put(self, map_id: str, **parts: Any) -> None:
        outline = MapOutline(6, 0, (0.0, 0.0, 1.0, 1.0), None, parts.get("oriented"))
        self.store.put(map_id, orjson.dumps(parts), outline)


def inline(**parts: Any) -> InlineMap:
    return InlineMap.model_validate({"segments": examples.WALLS, **parts})
