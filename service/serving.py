"""``linefix serve`` and ``python -m service``."""

from __future__ import annotations

import errno
import gc
import logging
import logging.config
import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .settings import Settings

logger = logging.getLogger("linefix")
# One search runs per core already: a second layer of threads in numpy's libraries would only get in its way. They read
# this when they are loaded, so before anything imports numpy.
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
# Failures of a disk that can be repaired while the service runs and reports that it is not ready.
AILING_DISK = (errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.EIO)
# Read by compiled.cache and by `cli`, which are not loaded here for these names.
NO_SETTINGS = ("LINEFIX_KERNELS", "LINEFIX_KEY")


def serve(arguments: Sequence[str]) -> int:
    """Read the settings and run the service."""
    gc.disable()  # until the service is ready
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    from .settings import SettingsError, read_settings

    try:
        settings = read_settings(arguments)
    except SettingsError as error:
        print(f"linefix: {error}", file=sys.stderr)
        return 2
    for name in unknown_settings():
        print(f"linefix: {name} in the environment is not a setting", file=sys.stderr)
    return run(settings)


def unknown_settings() -> list[str]:
    """Return what looks like a setting in the environment and is none."""
    from .settings import Settings

    known = {f"LINEFIX_{name.upper()}" for name in Settings.model_fields} | {*NO_SETTINGS}
    return sorted(name for name in os.environ if name.upper().startswith("LINEFIX_") and name.upper() not in known)


def run(settings: Settings) -> int:
    """Run until a signal comes; return the status to exit with."""
    from .process.server import serve as serve_settings
    from .telemetry.logs import log_config

    wrong = cannot_keep_maps(settings)
    if wrong is not None:
        print(f"linefix: {wrong}; name another directory with --data-dir, or LINEFIX_DATA_DIR", file=sys.stderr)
        return 1
    logging.config.dictConfig(log_config(settings.log_level))
    try:
        return serve_settings(settings)
    except OSError as error:
        logger.error(
            "cannot listen on %s port %d: %s; choose another port with --port, or another address with --host",
            settings.host,
            settings.port,
            error.strerror,
        )
        return 1


def cannot_keep_maps(settings: Settings) -> str | None:
    """Make the file of the maps where there is none; return why that will never do, None where it does or may yet.

    If it ran all the same, the service would never be ready, and only its log would show the reason.
    """
    from .database_location import file_of, make_file

    kept = file_of(settings.url)
    if kept is None or kept.exists():
        return None
    try:
        make_file(kept)
    except OSError as error:
        if error.errno not in AILING_DISK:
            return f"maps cannot be stored in {kept.parent}: {error.strerror}"
    return None
