"""From the poses that a search found to explanations, and the best of them worked out: all that the verdict weighs."""

from __future__ import annotations

from dataclasses import replace

from registration import RigidTransform

from .consensus.acceptance import accept, register_accepted
from .consensus.ranking import Ranked, rank_candidates
from .consensus.settling import settle
from .consensus.sight import agreement, compare_beams
from .context import SearchContext
from .explanations import Answer, Explanations
from .layout import FOUND, record
from .result import SearchReport
from .scan.views import corrected
from .search.candidates import Candidates, Effort, find_candidates
from .verdict.kernels.chance import worth_of
from .verdict.significance import significance

NOT_SEARCHED = SearchReport(False, False, 0.0, 0, 0, 0, 0, "ordered", 1.0)


def search_and_explain(context: SearchContext, effort: Effort | None = None) -> Explanations:
    """Search a scan and explain it by what was found; by default with the effort that the context calls for.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    return explain(context, find_candidates(context, effort))


def explain_at(context: SearchContext, pose: RigidTransform) -> Explanations:
    """Explain the scan from a pose in the map, m and radians, as if a search had found that alone.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    x, y = context.index.origin
    return explain(context, Candidates(record(FOUND, x=pose.x - x, y=pose.y - y, theta=pose.theta), NOT_SEARCHED))


def explain(context: SearchContext, candidates: Candidates) -> Explanations:
    """Rank the poses that a search found, and work out the best of them.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    ranked, search = tuple(rank_candidates(context, candidates)), _as_far_as(context, candidates)
    best = next((one for one in ranked if one.inside), None)
    return Explanations(ranked, None if best is None else _answer(context, best), search)


def _as_far_as(context: SearchContext, candidates: Candidates) -> SearchReport:
    """Return how the search went; what the deadline left unranked, or rays speak against, may have been worse."""
    as_far = context.can_look and not context.deadline.passed
    return candidates.report if as_far else candidates.report.cut_short()


def _answer(context: SearchContext, best: Ranked) -> Answer | None:
    accepted = accept(context, best)
    (settled,) = settle(context, [best], hinges=True)
    if settled.views is not None:
        # What is told of it holds where the views are found to have been.
        context = replace(context, scan=corrected(context.scan, settled.views.found, settled.views.spread))
    found = register_accepted(context, best, accepted, settled)
    if found is None:
        return None
    registered, settled = found
    chance = significance(context, worth_of(best.matches))
    beams = compare_beams(context, settled)
    return Answer(best, accepted, settled, registered, agreement(context, best), beams, chance)
