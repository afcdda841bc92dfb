"""What commands ask for, and in which form: that of the HTTP routes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Literal, Protocol

from service.importing.fields import Fields

Json = dict[str, Any]
Question = Literal["associate", "register", "vectorize"]
Progress = Callable[[int, int], None]
KEY = "LINEFIX_KEY"  # in the environment: arguments are seen by everyone on a machine


class MapKeeper(Protocol):
    """Stored maps.

    Every method raises `RefusedError` when what is sent is not taken, and `NoServerError` when nobody answers.
    """

    def put(self, map_id: str, document: Json) -> Json:
        """Store a map; return the answer of ``PUT``."""
        ...

    def get(self, map_id: str) -> Json:
        """Return a stored map."""
        ...

    def maps(self) -> Iterator[Json]:
        """Give what is told of each stored map, by id."""
        ...

    def remove(self, map_id: str) -> None:
        """Forget a stored map."""
        ...

    def close(self) -> None:
        """Close what was opened."""
        ...


class Service(Protocol):
    """What a command may ask for; the answers are those of the HTTP routes.

    Every method raises `RefusedError` when what is sent is not taken, and `NoServerError` when nobody answers.
    """

    def ask(self, question: Question, body: Json) -> Json:
        """Return the answer of ``POST /v1/<question>``."""
        ...

    def import_map(self, files: Sequence[Path], fields: Fields) -> Json:
        """Return the answer of ``POST /v1/maps:import``; the first file is the map, the others are those it names."""
        ...

    def check(self, on: Json, samples: Json | None) -> Json:
        """Return the answer of ``/v1/maps/{map_id}:check``; `on` is the map of a request."""
        ...

    def close(self) -> None:
        """Close what was opened."""
        ...


def id_of(on: object) -> str | None:
    """Return the id of a request's map, None where the map itself is there."""
    return on.get("map_id") if isinstance(on, dict) else None
