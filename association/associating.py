"""The main path: from a scan and a map index to a pose with its verdict."""

from __future__ import annotations

from registration.values import value

from .context import SearchContext
from .deadline import Deadline
from .explanations import Explanations
from .index.map_index import MapIndex
from .options import AssociationOptions, Prior
from .rank_and_estimate import rank_and_estimate
from .report import report
from .result import AssociationResult
from .scan.scan import Scan
from .search.candidates import find_candidates
from .to_scale import ScaledSearch, put_to_scale
from .verdict.verdict import Verdict, judge

DEFAULT_OPTIONS = AssociationOptions()


@value(frozen=True, slots=True)
class Stages:
    """The stages of an answer.

    Attributes
    ----------
    found : ScaledSearch
        The search, and its explanations.
    verdict : Verdict
        On them.
    result : AssociationResult
        The answer.
    """

    found: ScaledSearch
    verdict: Verdict
    result: AssociationResult

    @property
    def context(self) -> SearchContext:
        """The inputs of the search, with the scan to scale."""
        return self.found.context

    @property
    def explanations(self) -> Explanations:
        """The explanations that the answer was put together from."""
        return self.found.explanations


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
    found = put_to_scale(context, rank_and_estimate(context, find_candidates(context)))
    verdict = judge(found.context, found.explanations, off_scale=found.off_scale)
    return Stages(found, verdict, report(found, verdict))
