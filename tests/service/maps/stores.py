"""Stores opened for a test, and changed behind their back."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from sqlalchemy import Engine, event, text

from service.database_location import database_url
from service.maps import MapOutline, MapStore
from service.maps.database import open_engine
from service.maps.store import ANY

BOX = MapOutline(4, 0, (0.0, 0.0, 1.0, 1.0))


__all__ = ["ANY", "BOX", "alter", "engine_of", "on_every", "opened"]


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
