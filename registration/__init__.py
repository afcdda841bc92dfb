"""Known correspondences: the rigid transform that fits paired line segments, and how far to trust it."""

from .errors import InvalidArgumentError, InvalidSegmentsError, RegistrationError
from .result import Ambiguity, RegistrationDiagnostics, RegistrationResult
from .segments import MeasuredSegments, Segments
from .transform import RigidTransform, wrap_angle

__all__ = [
    "Ambiguity",
    "InvalidArgumentError",
    "InvalidSegmentsError",
    "MeasuredSegments",
    "RegistrationDiagnostics",
    "RegistrationError",
    "RegistrationResult",
    "RigidTransform",
    "Segments",
    "wrap_angle",
]
