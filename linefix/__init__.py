"""Linefix in Python, without HTTP: where in a map of wall segments a scan was taken, and how sure that is.

>>> import linefix
>>> room = [[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]]
>>> seen = [[-1, 1, -1, -5], [-1, -5, 1, -5], [1, -5, 1, -3], [1, -3, 4, -3], [4, -3, 4, 1], [4, 1, -1, 1]]
>>> answer = linefix.locate(room, seen)
>>> answer.usable
True

Metres, radians, counter-clockwise. The packages next to this one hold everything; this one names the parts that most
programs need. The readers and writers of files come with the extra ``linefix[formats]``.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import simulation
from association import (
    AssociationOptions,
    AssociationResult,
    Deadline,
    HardPrior,
    MapIndex,
    MapSet,
    Scan,
    SoftPrior,
    Status,
    View,
    assemble,
)
from registration import (
    Beams,
    InputError,
    MeasuredSegments,
    RegistrationOptions,
    RegistrationResult,
    RigidTransform,
    Segments,
    register,
)
from vectorization import LaserScan, Motion, Vectorization, VectorizationOptions, vectorize

from .checking import CheckedMap, check
from .driving import associate
from .explaining import Explanation, explain
from .locating import index_map, index_maps, locate, scan_of
from .ranges import MountedScan, view_of
from .updating import update_map

if TYPE_CHECKING:
    from formats import ImportOptions, LineMap, LogOptions, draw_map, read_log, read_map, write_map

_OF_FORMATS = frozenset(("ImportOptions", "LineMap", "LogOptions", "draw_map", "read_log", "read_map", "write_map"))

__all__ = [
    "AssociationOptions",
    "AssociationResult",
    "Beams",
    "CheckedMap",
    "Deadline",
    "Explanation",
    "HardPrior",
    "ImportOptions",
    "InputError",
    "LaserScan",
    "LineMap",
    "LogOptions",
    "MapIndex",
    "MapSet",
    "MeasuredSegments",
    "Motion",
    "MountedScan",
    "RegistrationOptions",
    "RegistrationResult",
    "RigidTransform",
    "Scan",
    "Segments",
    "SoftPrior",
    "Status",
    "Vectorization",
    "VectorizationOptions",
    "View",
    "assemble",
    "associate",
    "check",
    "draw_map",
    "explain",
    "index_map",
    "index_maps",
    "locate",
    "read_log",
    "read_map",
    "register",
    "scan_of",
    "simulation",
    "update_map",
    "vectorize",
    "view_of",
    "write_map",
]


def __getattr__(name: str) -> Any:
    """Import the readers and writers of files on first use: their libraries may be missing."""
    if name not in _OF_FORMATS:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        return getattr(importlib.import_module("formats"), name)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"linefix.{name} requires the extra `formats`. Install it, for example with "
            '`pip install ".[formats]"` in a '
            "checkout"
        ) from error


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
