"""Files of other tools in and out: maps, logs, poses. The extra ``linefix[formats]`` brings the libraries."""

from .colours import VERDICTS, rgb, verdict_of
from .errors import (
    FormatError,
    IncompleteFileError,
    InvalidOptionError,
    MalformedFileError,
    TooLargeError,
    UnsupportedFormatError,
    UprightFrameError,
)
from .line_map import GridPicture, ImportedMap, LineMap
from .logs.scan import UNUSABLE, Log, LoggedScan, LogOptions, scan_json, thinned
from .options import ImportOptions
from .picture import PlaceMark, draw_map
from .reading import LOG_SUFFIXES, MAP_SUFFIXES, map_of_grid, read_log, read_map
from .report import ImportReport, Note
from .writing import StampedPose, write_map, write_tum

__all__ = [
    "LOG_SUFFIXES",
    "MAP_SUFFIXES",
    "UNUSABLE",
    "VERDICTS",
    "FormatError",
    "GridPicture",
    "ImportOptions",
    "ImportReport",
    "ImportedMap",
    "IncompleteFileError",
    "InvalidOptionError",
    "LineMap",
    "Log",
    "LogOptions",
    "LoggedScan",
    "MalformedFileError",
    "Note",
    "PlaceMark",
    "StampedPose",
    "TooLargeError",
    "UnsupportedFormatError",
    "UprightFrameError",
    "draw_map",
    "map_of_grid",
    "read_log",
    "read_map",
    "rgb",
    "scan_json",
    "thinned",
    "verdict_of",
    "write_map",
    "write_tum",
]
