"""The main path: from a scan and a map index to a pose with its verdict."""

from __future__ import annotations

from dataclasses import dataclass

from .context import SearchContext
from .deadline import Deadline
from .explanations import Explanations, explain_scan
from .index.map_index import MapIndex
from .options import AssociationOptions, Prior
from .report import report
from .result import AssociationResult
from .scan.scan import Scan
from .verdict.verdict import Verdict, judge

DEFAULT_OPTIONS = AssociationOptions()


@dataclass(frozen=True, slots=True)
class Stages:
    """The stages of an answer: the scan that was searched, its explanations, the verdict, and the answer."""

    context: SearchContext
    explanations: Explanations
    verdict: Verdict
    result: AssociationResult


def associate(
    index: MapIndex,
    scan: Scan,
    prior: Prior | None = None,
    options: AssociationOptions = DEFAULT_OPTIONS,
    deadline: Deadline | None = None,
) -> AssociationResult:
    """Find where in a map a scan was taken, without knowing which segment is which.

    1. Search: propose poses from bases of two scan segments, verify them, grow and shrink their consensus sets.
    2. Estimate: rank the best poses with the lines of sight, the beams and the prior, and estimate the best of them.
    3. Judge: how likely the best pose is right, and whether a robot may use it.
    4. Report.

    Parameters
    ----------
    index : MapIndex
    scan : Scan
        In the sensor's frame.
    prior : SoftPrior, HardPrior or None
        In the map frame.
    options : AssociationOptions
    deadline : Deadline or None
        When it passes, the best so far is the answer and ``search.complete`` is False.

    Returns
    -------
    AssociationResult

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    return run_stages(SearchContext.of(index, scan, prior, options, deadline or Deadline())).result


def run_stages(context: SearchContext) -> Stages:
    """Search, estimate, judge and report as `associate` describes.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    context, explanations = explain_scan(context)
    verdict = judge(context, explanations)
    return Stages(context, explanations, verdict, report(context, explanations, verdict))
