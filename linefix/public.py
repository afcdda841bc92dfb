"""The names of the package: its own functions, and the parts of other packages that most programs need."""

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
from .driving import Explanation
from .locating import explain, index_map, index_maps, locate, scan_of
from .ranges import MountedScan, view_of
from .updating import update_map

if TYPE_CHECKING:
    from formats import ImportOptions, LineMap, LogOptions, draw_map, read_log, read_map, write_map

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
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    try:
        return getattr(importlib.import_module("formats"), name)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f'linefix.{name} requires the extra `formats`: in a checkout, `pip install ".[formats]"`'
        ) from error
