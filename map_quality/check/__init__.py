"""What is doubtful in a map, by itself and beside sample scans; told to whoever made it, and never held against it.

Everything here works on a `MapIndex` and uses the search as a caller would.
"""

from .check import check_map
from .judging import judge_samples
from .result import Advice, Finding, FindingCode, MapCheck, Place, SampleReport, Size
from .samples import Sample, try_sample
from .thickness import find_thickness, fit_better_mirrored, thickness_finding

__all__ = [
    "Advice",
    "Finding",
    "FindingCode",
    "MapCheck",
    "Place",
    "Sample",
    "SampleReport",
    "Size",
    "check_map",
    "find_thickness",
    "fit_better_mirrored",
    "judge_samples",
    "thickness_finding",
    "try_sample",
]
