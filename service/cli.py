"""The command line: ``linefix serve`` and ``python -m service``."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

USAGE = "usage: linefix serve [--host HOST] [--port PORT] [...]\nlinefix serve --help lists every setting."
# One search runs per core already: a second layer of threads in numpy's libraries would only get in its way. They read
# this when they are loaded, so before anything imports numpy.
ONE_THREAD = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def serve(arguments: Sequence[str]) -> int:
    """Read the settings and run the service."""
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
    from .settings import SettingsError, read_settings

    try:
        settings = read_settings(arguments)
    except SettingsError as error:
        print(f"linefix: {error}", file=sys.stderr)
        return 2
    from .server import serve as run

    run(settings)
    return 0


def main() -> None:
    """Run the subcommand that is named."""
    name, *rest = sys.argv[1:] or [""]
    if name in ("-h", "--help"):
        print(USAGE)
        sys.exit(0)
    if name != "serve":
        print(USAGE, file=sys.stderr)
        sys.exit(2)
    sys.exit(serve(rest))
