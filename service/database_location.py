"""Location of the stored maps: the database that an operator names, and the file of an SQLite database.

Light to import: the process that starts the workers uses it, too.
"""

from __future__ import annotations

import os
from pathlib import Path

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
        raise ValueError("expected a URL such as postgresql://user@host/database, found other text") from None
    if url.drivername in _POSTGRESQL:
        return url.set(drivername="postgresql+psycopg")
    if url.drivername in _SQLITE:
        return url
    raise ValueError(
        f"expected a URL that begins with sqlite:// or postgresql://, found one that begins with {url.drivername}://"
    )


def file_of(url: URL) -> Path | None:
    """Return the file of a database; None where it has no file of its own, or the URL opens it as a URI."""
    if url.get_backend_name() != "sqlite" or not url.database or url.database == ":memory:" or "uri" in url.query:
        return None
    return Path(url.database).absolute()


def make_file(path: Path) -> None:
    """Make the file of a database, for its owner alone, and its directory, so that a power cut leaves both.

    Raises
    ------
    OSError
        When it cannot be made.
    """
    folder = path.parent
    missing = [one for one in (folder, *folder.parents) if not one.exists()]
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    for made in missing:
        _sync(made.parent)
    # Files that SQLite later puts next to it have the same permissions.
    os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))
    _sync(folder)


def _sync(folder: Path) -> None:
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
