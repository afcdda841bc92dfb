"""The file that SQLite keeps maps in; light to import, since the process above several workers asks for it, too."""

from __future__ import annotations

import os
from pathlib import Path

from sqlalchemy import URL


def file_of(url: URL) -> Path | None:
    """Return the file that a database is kept in; None where it is in no file of its own, or the URL says how."""
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
    # What SQLite puts beside it later has the same permissions.
    os.close(os.open(path, os.O_RDWR | os.O_CREAT, 0o600))
    _sync(folder)


def _sync(folder: Path) -> None:
    opened = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
