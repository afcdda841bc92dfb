"""Who answers the questions of the command line: this process, or a server."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing, contextmanager

from .contract import Service
from .keeping import server_at


@contextmanager
def answering(server: str | None) -> Iterator[Service]:
    """Give who answers: the server at a URL, or this process where there is none."""
    if server is not None:
        with closing(server_at(server)) as remote:
            yield remote
        return
    from .in_process import InProcess

    with closing(InProcess()) as here:
        yield here
