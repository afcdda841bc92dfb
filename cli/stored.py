"""The store of maps that a service with the settings of this environment uses."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass

import orjson
from pydantic import ValidationError

from linefix.documents.limits import Limits
from linefix.documents.parts import MapDocument
from linefix.documents.reading import read_map, read_stored
from service.errors import CorruptMapError, StoreError, UnknownMapError
from service.maps import MapStore
from service.maps.lookup import outline_of
from service.settings import Settings

from .errors import NO_NAMES, Names, NoServerError, NoSuchMapError, RefusedError, WrongUseError, refusing
from .printing import Json

MAPS_AT_ONCE = 1000


@dataclass(frozen=True, slots=True)
class StoredMaps:
    """The maps that a service stores; the methods are those of its client."""

    store: MapStore
    limits: Limits

    def put_map(self, map_id: str, document: Json) -> Json:
        """Store a map where a service with these settings would."""
        asked, kept = read_map(orjson.dumps(document), self.limits)
        outline = outline_of(asked)
        revision, _ = self.store.put(map_id, kept, outline)
        return outline.as_json(map_id, revision)

    def get_map(self, map_id: str) -> Json:
        """Return a stored map."""
        document: Json = orjson.loads(self.store.load(map_id).document)
        return document

    def list_maps(self, cursor: str | None) -> Json:
        """Return the summaries of some stored maps, by id, and where to go on in `next`."""
        page = self.store.list(MAPS_AT_ONCE, cursor or "")
        return {"maps": [one.as_json() for one in page.maps], "next": page.next}

    def delete_map(self, map_id: str) -> None:
        """Remove a stored map."""
        self.store.delete(map_id)

    def found(self, map_id: str) -> tuple[MapDocument, Json]:
        """Return a stored map, and its id and revision."""
        stored = self.store.load(map_id)
        return read_stored(stored.document), {"map_id": map_id, "revision": stored.record.revision}


@contextmanager
def stored_maps(map_id: str = "", names: Names = NO_NAMES) -> Iterator[StoredMaps]:
    """Give the stored maps; raise errors of the command line in place of those of the store.

    `map_id` is what is sought there; `names` are the user's for places in what is to be stored.
    """
    try:
        settings = Settings()
    except ValidationError as error:
        wrong = error.errors()[0]
        name = ".".join(str(part) for part in wrong["loc"])
        raise WrongUseError(f"LINEFIX_{name.upper()} in the environment: {wrong['msg']}") from None
    try:
        with closing(MapStore(settings.url, most_bytes=settings.max_stored_bytes)) as store, refusing(names):
            yield StoredMaps(store, settings.limits())
    except UnknownMapError:
        raise NoSuchMapError(map_id) from None
    except CorruptMapError as error:
        raise RefusedError(str(error)) from None
    except StoreError as error:
        raise NoServerError(str(error)) from None
