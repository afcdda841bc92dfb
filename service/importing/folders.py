"""Folders for files that were sent: each goes with its import, and with the next one where a service was killed."""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

PREFIX = "linefix-import-"
SHARED_MEMORY = Path("/dev/shm")  # may be written to in a container whose root may not
YOUNG_SECONDS = 10.0  # s in which a folder that was made may not be locked yet


@contextmanager
def own_folder() -> Iterator[Path]:
    """Give a folder that goes when the block ends, and is locked until then.

    Raises
    ------
    OSError
        When none can be made.
    """
    place = _place()
    remove_abandoned(place)
    with tempfile.TemporaryDirectory(prefix=PREFIX, dir=place, ignore_cleanup_errors=True) as name:
        descriptor = os.open(name, os.O_RDONLY | os.O_DIRECTORY)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX)
            yield Path(name)
        finally:
            os.close(descriptor)


def remove_abandoned(place: Path | None = None) -> None:
    """Remove the folders of this user's imports whose service was killed: nothing holds their locks any more."""
    for folder in (place or _place()).glob(f"{PREFIX}*"):
        with suppress(OSError):  # of another user, removed meanwhile, or in use
            _remove(folder)


def _remove(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        state = os.fstat(descriptor)
        if state.st_uid != os.geteuid() or time.time() - state.st_ctime < YOUNG_SECONDS:
            return
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        shutil.rmtree(folder, ignore_errors=True)
    finally:
        os.close(descriptor)


def _place() -> Path:
    try:
        return Path(tempfile.gettempdir())
    except FileNotFoundError:  # none can be written to
        return SHARED_MEMORY
