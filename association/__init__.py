"""Unknown correspondences: where in a map of segments a scan was taken, and how sure that is."""

from registration import Beams

from .associating import associate
from .deadline import CancelledError, Deadline
from .errors import AssociationError, IndexingEndedError, InvalidMapError, InvalidSearchError
from .index.joint import MapPart
from .index.map_index import MapIndex
from .index.map_points import NO_POINTS, MapPoints
from .options import INCLUDED, AssociationOptions, HardPrior, Prior, SoftPrior
from .result import (
    AS_WELL,
    Alternative,
    AssociationDiagnostics,
    AssociationResult,
    AssociationWarning,
    Corrections,
    Correspondence,
    CriticalWall,
    MapVerdict,
    Reason,
    ReasonCode,
    SearchReport,
    Status,
    WarningCode,
)
from .scan.scan import Scan, Views, mirrored, scaled, turned_round
from .scan.views import MAX_VIEWS, View, assemble
from .several_maps import NOTHING_KNOWN, KnownOfMaps, MapSet, associate_on_maps
from .verdict_explanation import AnswerExplanation, Contribution, VerdictExplanation, explain_verdict
from .warnings import NOT_IN_ORDER

__all__ = [
    "AS_WELL",
    "INCLUDED",
    "MAX_VIEWS",
    "NOTHING_KNOWN",
    "NOT_IN_ORDER",
    "NO_POINTS",
    "Alternative",
    "AnswerExplanation",
    "AssociationDiagnostics",
    "AssociationError",
    "AssociationOptions",
    "AssociationResult",
    "AssociationWarning",
    "Beams",
    "CancelledError",
    "Contribution",
    "Corrections",
    "Correspondence",
    "CriticalWall",
    "Deadline",
    "HardPrior",
    "IndexingEndedError",
    "InvalidMapError",
    "InvalidSearchError",
    "KnownOfMaps",
    "MapIndex",
    "MapPart",
    "MapPoints",
    "MapSet",
    "MapVerdict",
    "Prior",
    "Reason",
    "ReasonCode",
    "Scan",
    "SearchReport",
    "SoftPrior",
    "Status",
    "VerdictExplanation",
    "View",
    "Views",
    "WarningCode",
    "assemble",
    "associate",
    "associate_on_maps",
    "explain_verdict",
    "mirrored",
    "scaled",
    "turned_round",
]
