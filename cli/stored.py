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

from .errors import NO_NAMES, Names, NoServerError, NoSuchMapError, RefusedError, WrongUseError, refusing
from .printing import Json

MAPS_AT_ONCE = 1000


class StoredMaps:
    """The maps that a service with these settings stores; the methods are those of its client."""

    def __init__(self, names: Names = NO_NAMES) -> None:
        self._names = names
        try:
            self._settings = Settings()
        except ValidationError as error:
            wrong = error.errors()[0]
            name = ".".join(str(part) for part in wrong["loc"])
            raise WrongUseError(f"LINEFIX_{name.upper()} in the environment: {wrong['msg']}") from None
        self._store = MapStore(self._settings.url, most_bytes=self._settings.max_stored_bytes)

    def close(self) -> None:
        """Close the store."""
        self._store.close()

    def put_map(self, map_id: str, document: Json) -> Json:
        """Store a map where a service with these settings would."""
        with refusing(self._names), _reaching(map_id):
            asked, kept = read_map(orjson.dumps(document), self._settings.limits())
            outline = outline_of(asked)
            revision, _ = self._store.put(map_id, kept, outline)
            return outline.as_json(map_id, revision)

    def get_map(self, map_id: str) -> Json:
        """Return a stored map."""
        with _reaching(map_id):
            document: Json = orjson.loads(self._store.load(map_id).document)
            return document

    def list_maps(self, cursor: str | None) -> Json:
        """Return the summaries of some stored maps, by id, and where to go on in `next`."""
        with _reaching():
            page = self._store.list(MAPS_AT_ONCE, cursor or "")
        return {"maps": [one.as_json() for one in page.maps], "next": page.next}

    def delete_map(self, map_id: str) -> None:
        """Remove a stored map."""
        with _reaching(map_id):
            self._store.delete(map_id)

    def found(self, map_id: str) -> tuple[MapDocument, Json]:
        """Return a stored map, and its id and revision."""
        with _reaching(map_id):
            stored = self._store.load(map_id)
            return read_stored(stored.document), {"map_id": map_id, "revision": stored.record.revision}


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
