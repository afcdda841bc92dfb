"""Laser ranges and ordered points to directed line segments."""

from .errors import InvalidOptionError, InvalidScanError, VectorizationError
from .laser import LaserScan, Motion, require_angle_max
from .options import VectorizationOptions
from .vectorizer import Vectorization, vectorize

__all__ = [
    "InvalidOptionError",
    "InvalidScanError",
    "LaserScan",
    "Motion",
    "Vectorization",
    "VectorizationError",
    "VectorizationOptions",
    "require_angle_max",
    "vectorize",
]
