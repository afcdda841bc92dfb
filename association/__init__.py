"""Unknown correspondences: where in a map of segments a scan was taken, and how sure that is."""

from registration import Beams

from .errors import AssociationError, IndexingEndedError, InvalidMapError, InvalidSearchError
from .map_index import MapIndex
from .options import (
    PARTS,
    AssociationOptions,
    CancelledError,
    Deadline,
    HardPrior,
    Prior,
    SoftPrior,
)
from .result import (
    Alternative,
    AssociationDiagnostics,
    AssociationResult,
    AssociationWarning,
    Correspondence,
    Hinge,
    Reason,
    SearchReport,
    Status,
)
from .scan import Scan, Views, mirrored
from .search import associate
from .views import MAX_VIEWS, View, assemble
from .words import AS_WELL, sentence_of

__all__ = [
    "AS_WELL",
    "MAX_VIEWS",
    "PARTS",
    "Alternative",
    "AssociationDiagnostics",
    "AssociationError",
    "AssociationOptions",
    "AssociationResult",
    "AssociationWarning",
    "Beams",
    "CancelledError",
    "Correspondence",
    "Deadline",
    "HardPrior",
    "Hinge",
    "IndexingEndedError",
    "InvalidMapError",
    "InvalidSearchError",
    "MapIndex",
    "Prior",
    "Reason",
    "Scan",
    "SearchReport",
    "SoftPrior",
    "Status",
    "View",
    "Views",
    "assemble",
    "associate",
    "mirrored",
    "sentence_of",
]
