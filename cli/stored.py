"""The store of maps that a service with the settings of this environment uses."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import orjson
from pydantic import ValidationError

from linefix.documents.parts import MapDocument
from linefix.documents.reading import read_map, read_stored
from service.errors import CorruptMapError, StoreError, UnknownMapError
from service.maps import MapStore
from service.maps.lookup import outline_of
from service.settings import Settings

from .errors import NoServerError, NoSuchMapError, RefusedError, WrongUseError, refusing
from .printing import Json

MAPS_AT_ONCE = 1000


class StoredMaps:
    """The maps that a service with these settings stores."""

    def __init__(self) -> None:
        self._settings = _settings()
        self._store = MapStore(self._settings.url, most_bytes=self._settings.max_stored_bytes)

    def close(self) -> None:
        """Close the store."""
        self._store.close()

    def put(self, map_id: str, document: Json) -> Json:
        """Store a map where a service with these settings would."""
        with refusing(), _reaching(map_id):
            asked, kept = read_map(orjson.dumps(document), self._settings.limits())
            outline = outline_of(asked)
            revision, _ = self._store.put(map_id, kept, outline)
            return outline.as_json(map_id, revision)

    def get(self, map_id: str) -> Json:
        """Return a stored map."""
        with _reaching(map_id):
            document: Json = orjson.loads(self._store.load(map_id).document)
            return document

    def found(self, map_id: str) -> tuple[MapDocument, Json]:
        """Return a stored map, and its id and revision."""
        with _reaching(map_id):
            stored = self._store.load(map_id)
            return read_stored(stored.document), {"map_id": map_id, "revision": stored.record.revision}

    def maps(self) -> Iterator[Json]:
        """Yield the summary of each stored map, by id."""
        after: str | None = ""
        while after is not None:
            with _reaching():
                page = self._store.list(MAPS_AT_ONCE, after)
            yield from (one.as_json() for one in page.maps)
            after = page.next

    def remove(self, map_id: str) -> None:
        """Remove a stored map."""
        with _reaching(map_id):
            self._store.delete(map_id)


def _settings() -> Settings:
    """Return the settings of the environment; raises `WrongUseError` where one is wrong."""
    try:
        return Settings()
    except ValidationError as error:
        wrong = error.errors()[0]
        name = ".".join(str(part) for part in wrong["loc"])
        raise WrongUseError(f"LINEFIX_{name.upper()} in the environment: {wrong['msg']}") from None


@contextmanager
def _reaching(map_id: str = "") -> Iterator[None]:
    """Raise an error of the command line in place of those of the store; `map_id` is what is sought there."""
    try:
        yield
    except UnknownMapError:
        raise NoSuchMapError(map_id) from None
    except CorruptMapError as error:
        raise RefusedError(str(error)) from None
    except StoreError as error:
        raise NoServerError(str(error)) from None
