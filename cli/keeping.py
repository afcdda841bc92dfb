"""Who has the stored maps: a server, or the store of a service with the settings of this environment."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING

from .contract import KEY, MapKeeper
from .errors import RefusedError

if TYPE_CHECKING:
    from .server import Server


@contextmanager
def keeping(server: str | None) -> Iterator[MapKeeper]:
    """Give the stored maps: those of the server at a URL, or those here where there is none."""
    if server is not None:
        with closing(server_at(server)) as remote:
            yield remote
        return
    from .stored import StoredMaps

    with closing(StoredMaps()) as here:
        yield here


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
            f"--server needs {error.name}: pip install ./clients/python from the sources of Linefix, or leave it out"
        ) from None
    return Server(url, os.environ.get(KEY) or None)
