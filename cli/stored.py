"""The store of maps that a service with the settings of this environment uses."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass

import orjson
from pydantic import ValidationError

from service.contract import InlineMap
from service.maps import MapStore, Preconditions
from service.maps.errors import CorruptMapError, StoreError, UnknownMapError
from service.maps.lookup import outline_of
from service.parsing.reading import read_map
from service.settings import Settings

from .contract import Json, id_of
from .errors import NoServerError, NoSuchMapError, RefusedError, WrongUseError
from .inputs import refusing

MAPS_AT_ONCE = 1000


@dataclass(frozen=True, slots=True)
class FoundMap:
    """A map document, and id and revision where it is stored."""

    document: Json
    reference: Json | None


def map_here(on: Json) -> FoundMap:
    """Return the map of a file as it is, or the stored one whose id was given."""
    map_id = id_of(on)
    if map_id is None:
        return FoundMap(on, None)
    with closing(StoredMaps()) as maps:
        return maps.found(map_id)


class StoredMaps:
    """The maps that a service with these settings stores."""

    def __init__(self) -> None:
        self._settings = settings_here()
        self._store = MapStore(self._settings.url, most_bytes=self._settings.max_stored_bytes)

    def close(self) -> None:
        """Close the store."""
        self._store.close()

    def put(self, map_id: str, document: Json) -> Json:
        """Store a map where a service with these settings would."""
        with refusing(), _reaching(map_id):
            asked, kept = read_map(orjson.dumps(document), self._settings.limits())
            outline = outline_of(asked)
            revision, _ = self._store.put(map_id, kept, outline, Preconditions())
            return outline.as_json(map_id, revision)

    def get(self, map_id: str) -> Json:
        """Return a stored map."""
        return self.found(map_id).document

    def found(self, map_id: str) -> FoundMap:
        """Return a stored map with its revision."""
        with _reaching(map_id):
            stored = self._store.load(map_id)
            reference = {"map_id": map_id, "revision": stored.record.revision}
            return FoundMap(orjson.loads(stored.document), reference)

    def maps(self) -> Iterator[Json]:
        """Yield the summary of each stored map, by id."""
        after: str | None = ""
        while after is not None:
            with _reaching():
                page = self._store.list(MAPS_AT_ONCE, after)
            yield from (one.outline.as_json(one.map_id, one.revision) for one in page.maps)
            after = page.next

    def remove(self, map_id: str) -> None:
        """Remove a stored map."""
        with _reaching(map_id):
            self._store.delete(map_id, Preconditions())


def settings_here() -> Settings:
    """Return the settings of the environment; raises `WrongUseError` where one is wrong."""
    try:
        return Settings()
    except ValidationError as error:
        wrong = error.errors()[0]
        name = ".".join(str(part) for part in wrong["loc"])
        raise WrongUseError(f"LINEFIX_{name.upper()} in the environment: {wrong['msg']}") from None


def require_size(document: Json) -> None:
    """Raise `RefusedError` where a map has more segments than the settings of the environment allow."""
    most, segments = settings_here().max_map_segments, len(document["segments"])
    if segments > most:
        raise RefusedError(
            f"the map has {segments} segments, expected at most {most} map segments; set LINEFIX_MAX_MAP_SEGMENTS"
        )


def require_storable(line_map: InlineMap) -> None:
    """Raise `InputError` where a map could not be stored."""
    outline_of(line_map)


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
