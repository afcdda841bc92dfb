"""The form of requests and answers: that of the HTTP routes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Literal, Protocol

Json = dict[str, Any]
Fields = Mapping[str, Sequence[str]]
"""Of a form: values as text; a field may be there several times."""
Question = Literal["associate", "register", "vectorize"]
Progress = Callable[[int, int], None]
KEY = "LINEFIX_KEY"  # in the environment: arguments are seen by everyone on a machine


class MapKeeper(Protocol):
    """Stored maps.

    Every method raises `RefusedError` when the input is rejected, and `NoServerError` when no server answers.
    """

    def put(self, map_id: str, document: Json) -> Json:
        """Store a map; return the answer of ``PUT``."""
        ...

    def get(self, map_id: str) -> Json:
        """Return a stored map."""
        ...

    def maps(self) -> Iterator[Json]:
        """Yield the summary of each stored map, by id."""
        ...

    def remove(self, map_id: str) -> None:
        """Forget a stored map."""
        ...

    def close(self) -> None:
        """Close all that was opened."""
        ...


def id_of(on: object) -> str | None:
    """Return the id of a request's map, None where the map itself is there."""
    return on.get("map_id") if isinstance(on, dict) else None
