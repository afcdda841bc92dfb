"""Reading a log: which reader, by the file's name."""

from __future__ import annotations

import os
from pathlib import Path

from .errors import UnsupportedFormatError
from .files import ending_of, name_of
from .logs.carmen import read_carmen
from .logs.folders import SUFFIXES, is_bag
from .logs.ros import read_bag
from .logs.scan import Log, LogOptions

TEXTS = (".log", ".clf", ".carmen")
LOG_SUFFIXES = (*SUFFIXES, *TEXTS)
"""Of files that `read_log` reads."""
DEFAULT_OPTIONS = LogOptions()


def read_log(path: str | os.PathLike[str], options: LogOptions = DEFAULT_OPTIONS) -> Log:
    """Open a log; its scans are read while iterating.

    Parameters
    ----------
    path : str or path
        A ``.bag`` of ROS 1; the folder of a bag of ROS 2, or its ``.mcap`` or ``.db3``; a ``.log``, ``.clf`` or
        ``.carmen`` of CARMEN.
    options : LogOptions

    Returns
    -------
    Log

    Raises
    ------
    FormatError
        When the file cannot be read, in one line that names it; while iterating, too.
    """
    file = Path(path)
    if is_bag(file):
        return read_bag(file, options)
    if file.suffix.lower() in TEXTS:
        return read_carmen(file, options)
    known = ", ".join(LOG_SUFFIXES)
    raise UnsupportedFormatError(
        f"expected the folder of a bag, or a file that ends in one of {known}, found {ending_of(file)}",
        argument=name_of(file),
    )
