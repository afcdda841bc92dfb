"""Unknown correspondences: where in a map of segments a scan was taken, and how sure that is."""

from .options import (
    AssociationOptions,
    Beams,
    CancelledError,
    Deadline,
    HardPrior,
    Prior,
    Scan,
    SoftPrior,
)
from .result import (
    Alternative,
    AssociationDiagnostics,
    AssociationResult,
    AssociationWarning,
    Correspondence,
    SearchReport,
    Status,
)

__all__ = [
    "Alternative",
    "AssociationDiagnostics",
    "AssociationOptions",
    "AssociationResult",
    "AssociationWarning",
    "Beams",
    "CancelledError",
    "Correspondence",
    "Deadline",
    "HardPrior",
    "Prior",
    "Scan",
    "SearchReport",
    "SoftPrior",
    "Status",
]
