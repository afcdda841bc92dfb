"""Laser ranges and ordered points to directed line segments."""

from .errors import InvalidOptionError, InvalidScanError, VectorizationError
from .laser import LaserScan
from .options import VectorizationOptions
from .vectorizer import Vectorization, vectorize

__all__ = [
    "InvalidOptionError",
    "InvalidScanError",
    "LaserScan",
    "Vectorization",
    "VectorizationError",
    "VectorizationOptions",
    "vectorize",
]
