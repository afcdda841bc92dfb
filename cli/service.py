"""Who answers the questions of the command line: this process, or a server."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal, Protocol

from service.importing.fields import Fields

Json = dict[str, Any]
Question = Literal["associate", "register", "vectorize"]
Progress = Callable[[int, int], None]
KEY = "LINEFIX_KEY"  # in the environment: arguments are seen by everyone on a machine


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

    def analyze(self, body: Json, progress: Progress) -> Json:
        """Return the answer of ``POST /v1/analyze``; `progress` is told how many poses are done, of how many."""
        ...

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


def id_of(on: object) -> str | None:
    """Return the id of a request's map, None where the map itself is there."""
    return on.get("map_id") if isinstance(on, dict) else None


@contextmanager
def answering(server: str | None) -> Iterator[Service]:
    """Give who answers: the server at a URL, or this process where there is none."""
    if server is not None:
        from .remote import RemoteService

        yield RemoteService(server, os.environ.get(KEY) or None)
        return
    from .in_process import InProcess

    service = InProcess()
    try:
        yield service
    finally:
        service.close()
