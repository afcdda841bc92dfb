"""The main path: from a scan and a map index to a pose with its verdict."""

from __future__ import annotations

import time

from registration.values import value

from .causes import find_causes
from .context import SearchContext
from .deadline import Deadline
from .explain import explain
from .index.map_index import MapIndex
from .last_view import LastView, search_last_view
from .options import AssociationOptions, Prior
from .report import report, with_causes
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
    last : LastView
        Of a drive that is not usable: its last view alone.
    result : AssociationResult
        The answer.
    """

    found: ScaledSearch
    verdict: Verdict
    last: LastView
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
    2. Explain: rank the best poses with the lines of sight, the beams and the prior, and work out the best of them.
    3. Search again to scale, if scan and map differ by a factor near one according to the best explanation.
    4. Judge: how likely the best explanation is right, and whether a robot may use it.
    5. Search the last view of a drive alone, where the drive may not be used: its answer stands where both agree.
    6. Find causes, where it may not: search the scan without each of a caller's usual mistakes.

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
    return run_stages(index, scan, prior, options, deadline).result


def run_stages(
    index: MapIndex,
    scan: Scan,
    prior: Prior | None = None,
    options: AssociationOptions = DEFAULT_OPTIONS,
    deadline: Deadline | None = None,
) -> Stages:
    """Find the same; return it with the stages that it comes from."""
    began = time.monotonic()
    context = SearchContext.of(index, scan, prior, options, deadline or Deadline())
    candidates = find_candidates(context)
    explanations = explain(context, candidates)
    found = put_to_scale(context, explanations)
    verdict = judge(found.context, found.explanations, off_scale=found.off_scale)
    last = search_last_view(found.context, verdict)
    if last.result is not None:
        return Stages(found, verdict, last, last.result)
    verdict = verdict if last.complete else verdict.cut_short()
    result = report(found.context, found.explanations, verdict, found.factor)
    result = with_causes(result, find_causes(context, found.explanations, verdict, began))
    return Stages(found, verdict, last, result)
