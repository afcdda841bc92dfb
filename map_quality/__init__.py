"""Quality of a map: its doubtful parts, the poses at which a robot would fail to localize, and what has changed.

`check` examines a map alone and with sample scans taken in it. `analyze` puts a virtual scanner on a grid of poses and
searches each of its scans in the map. `update` proposes changes that scans of several visits show. All call the search
as a program would; a finding never changes an answer.
"""

from .analyze.analyze import Analysis, PlaceVerdict
from .check.check import check_map
from .check.judging import conclude
from .check.result import Advice, Finding, FindingCode, MapCheck, Place, SampleReport, Size
from .check.samples import Sample, try_sample
from .update.result import (
    NOT_SHARPENED,
    Change,
    ChangeCode,
    Evidence,
    KeptCode,
    MapUpdate,
    Replacement,
    Sharpened,
    Usable,
    apply_changes,
)
from .update.scans import UpdateError, VisitScan
from .update.update import updating
from .views import AnalysisError, Robot, finished

__all__ = [
    "NOT_SHARPENED",
    "Advice",
    "Analysis",
    "AnalysisError",
    "Change",
    "ChangeCode",
    "Evidence",
    "Finding",
    "FindingCode",
    "KeptCode",
    "MapCheck",
    "MapUpdate",
    "Place",
    "PlaceVerdict",
    "Replacement",
    "Robot",
    "Sample",
    "SampleReport",
    "Sharpened",
    "Size",
    "UpdateError",
    "Usable",
    "VisitScan",
    "apply_changes",
    "check_map",
    "conclude",
    "finished",
    "try_sample",
    "updating",
]
