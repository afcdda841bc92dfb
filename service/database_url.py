"""Where the maps are kept, as an operator writes it."""

from __future__ import annotations

from sqlalchemy import URL, make_url
from sqlalchemy.exc import ArgumentError

_POSTGRESQL = ("postgres", "postgresql", "postgresql+psycopg")
_SQLITE = ("sqlite", "sqlite+pysqlite")


def database_url(text: str) -> URL:
    """Return a database's URL with the driver that is used for it.

    Raises
    ------
    ValueError
        When it is none, or of a database that the store cannot use. Never names the URL: it may hold a password.
    """
    try:
        url = make_url(text)
    except (ArgumentError, ValueError):
        raise ValueError("expected a URL such as postgresql://user@host/database") from None
    if url.drivername in _POSTGRESQL:
        return url.set(drivername="postgresql+psycopg")
    if url.drivername in _SQLITE:
        return url
    raise ValueError("expected a URL that begins with sqlite:// or postgresql://")
