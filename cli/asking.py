"""The target of a command: the server at a URL, or this process and the store of maps of this machine."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING

from .contract import KEY, Json, MapKeeper, Question
from .errors import RefusedError
from .inputs import read_map_or_id

if TYPE_CHECKING:
    from .server import Server


def ask(question: Question, body: Json, server: str | None) -> Json:
    """Return the answer of ``POST /v1/<question>``: of the server at a URL, or of this process where there is none."""
    if server is not None:
        with closing(server_at(server)) as remote:
            return remote.ask(question, body)
    from . import here

    return here.answer(question, body)


@contextmanager
def keeping(server: str | None) -> Iterator[MapKeeper]:
    """Give the stored maps: those of the server at a URL, or those of this machine where there is none."""
    if server is not None:
        with closing(server_at(server)) as remote:
            yield remote
        return
    from .stored import StoredMaps

    with closing(StoredMaps()) as maps:
        yield maps


def whole_map(on: Json, server: str | None) -> Json:
    """Return the map of a request itself, also where the request has its id; raises `RefusedError` where it is gone."""
    if "map_id" not in on:
        return on
    with keeping(server) as maps:
        return maps.get(on["map_id"])


def document_at(name: str, server: str | None) -> Json:
    """Return a map itself: that of a file, or a stored one.

    Raises
    ------
    WrongUseError, RefusedError
        When there is none, or it is not taken.
    """
    return whole_map(read_map_or_id(name), server)


def server_at(url: str) -> Server:
    """Return the server at a URL.

    Raises
    ------
    RefusedError
        When the client is not installed.
    WrongUseError
        When the URL is none.
    """
    try:
        from .server import Server
    except ModuleNotFoundError as error:
        raise RefusedError(
            f"--server needs {error.name}: in a checkout, pip install ./clients/python, or omit --server"
        ) from None
    return Server(url, os.environ.get(KEY) or None)
