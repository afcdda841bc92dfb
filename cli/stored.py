"""Maps that are stored where a service with the settings of this environment would store them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass

import orjson
from pydantic import ValidationError

from service.http.problems import problem_of
from service.maps import MapStore, Preconditions
from service.maps.lookup import outline_of
from service.parsing.reading import read_map
from service.settings import Settings
from service.work.answers import outline_json

from .contract import Json, id_of
from .errors import NOTHING, Asked, CommandError, RefusedError, WrongUseError, error_of

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
        with refusing():
            asked, kept = read_map(orjson.dumps(document), self._settings.limits())
            outline = outline_of(asked)
            revision, _ = self._store.put(map_id, kept, outline, Preconditions())
            return outline_json(map_id, revision, outline)

    def get(self, map_id: str) -> Json:
        """Return a stored map."""
        return self.found(map_id).document

    def found(self, map_id: str) -> FoundMap:
        """Return a stored map with its revision."""
        with refusing(Asked(map_id)):
            stored = self._store.load(map_id)
            reference = {"map_id": map_id, "revision": stored.record.revision}
            return FoundMap(orjson.loads(stored.document), reference)

    def maps(self) -> Iterator[Json]:
        """Give what is told of each stored map, by id."""
        after: str | None = ""
        while after is not None:
            with refusing():
                page = self._store.list(MAPS_AT_ONCE, after)
            yield from (outline_json(one.map_id, one.revision, one.outline) for one in page.maps)
            after = page.next

    def remove(self, map_id: str) -> None:
        """Remove a stored map."""
        with refusing(Asked(map_id)):
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


@contextmanager
def refusing(asked: Asked = NOTHING) -> Iterator[None]:
    """Turn what the service would answer as a problem into an error of the command line."""
    try:
        yield
    except CommandError:
        raise
    except Exception as error:
        problem = problem_of(error)
        if problem is None:
            raise
        faults = [{"pointer": fault.pointer, "message": fault.message} for fault in problem.faults]
        raise error_of(problem.kind.status, problem.kind.code, problem.detail, faults, asked) from error
