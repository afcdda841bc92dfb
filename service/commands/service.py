"""Who answers the questions of the command line: this process, or a server."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Literal, Protocol

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

    def analyze(self, body: Json, progress: Progress) -> Json:
        """Return the answer of ``POST /v1/analyze``; `progress` is told how many poses are done, of how many."""
        ...


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
