"""Files of other tools in and out: maps, logs, poses. The extra ``linefix[formats]`` brings the libraries."""

from .errors import (
    FormatError,
    IncompleteFileError,
    InvalidOptionError,
    MalformedFileError,
    TooLargeError,
    UnsupportedFormatError,
)
from .line_map import ImportedMap, LineMap
from .maps import read_map
from .options import ImportOptions
from .picture import draw_map
from .report import ImportReport, Note
from .writing import write_map

__all__ = [
    "FormatError",
    "ImportOptions",
    "ImportReport",
    "ImportedMap",
    "IncompleteFileError",
    "InvalidOptionError",
    "LineMap",
    "MalformedFileError",
    "Note",
    "TooLargeError",
    "UnsupportedFormatError",
    "draw_map",
    "read_map",
    "write_map",
]
