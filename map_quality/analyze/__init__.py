"""Where a map will fail: a virtual scanner stands all over it, and each of its scans is searched in the map."""

from .analyze import Analysis, PlaceVerdict
from .errors import AnalysisError
from .robot import Robot
from .standing import Standing, standing_places

__all__ = [
    "Analysis",
    "AnalysisError",
    "PlaceVerdict",
    "Robot",
    "Standing",
    "standing_places",
]
