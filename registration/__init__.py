"""Known correspondences: the rigid transform that fits paired line segments, and how far to trust it."""

from .correspondences import Correspondences
from .errors import InputError, InvalidArgumentError, InvalidSegmentsError, RegistrationError
from .options import RegistrationOptions
from .result import Ambiguity, RegistrationDiagnostics, RegistrationResult
from .segments import Beams, MeasuredSegments, Segments
from .solve import register
from .sums import JointSums, OneStepSums
from .transform import IDENTITY, RigidTransform, wrap_angle
from .wall_error import register_estimating

__all__ = [
    "IDENTITY",
    "Ambiguity",
    "Beams",
    "Correspondences",
    "InputError",
    "InvalidArgumentError",
    "InvalidSegmentsError",
    "JointSums",
    "MeasuredSegments",
    "OneStepSums",
    "RegistrationDiagnostics",
    "RegistrationError",
    "RegistrationOptions",
    "RegistrationResult",
    "RigidTransform",
    "Segments",
    "register",
    "register_estimating",
    "wrap_angle",
]
