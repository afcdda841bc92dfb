"""From a prepared search to its explanations, and the best of them worked out: all that the verdict weighs."""

from __future__ import annotations

from dataclasses import replace

from registration import RigidTransform

from .acceptance import accept, register_accepted
from .answering import answer_at_once, is_plain
from .candidates import Candidates, Effort, find_candidates
from .context import SearchContext
from .explanations import Answer, Explanations
from .kernels.chance import worth_of
from .layout import FOUND, record
from .ranking import Ranked, rank_candidates
from .result import SearchReport
from .settling import settle
from .sight import NO_BEAMS, agreement, compare_beams
from .significance import significance
from .views import corrected

NOT_SEARCHED = SearchReport(False, False, 0.0, 0, 0, 0, 0, "ordered", 1.0)


def explain(context: SearchContext, effort: Effort | None = None) -> Explanations:
    """Search, rank what was found, and work out the best of it; by default with the effort that the context wants.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    if effort is None and is_plain(context):
        return _explain_at_once(context)
    return _explain_by(context, find_candidates(context, effort))


def explain_at(context: SearchContext, pose: RigidTransform) -> Explanations:
    """Explain the scan from a pose in the map, m and radians, as if a search had found that alone.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    x, y = context.index.origin
    return _explain_by(context, Candidates(record(FOUND, x=pose.x - x, y=pose.y - y, theta=pose.theta), NOT_SEARCHED))


def _explain_at_once(context: SearchContext) -> Explanations:
    candidates, told = answer_at_once(context)
    if told is None:
        return _explain_by(context, candidates)
    search = _as_far_as(context, candidates)
    best = told.ranked[0]
    accepted = accept(context, best)
    registered = register_accepted(context, accepted, told.settled)
    if registered is None:
        return Explanations(told.ranked, None, search)
    answer = Answer(best, accepted, told.settled, registered, told.agreement, NO_BEAMS, told.significance)
    return Explanations(told.ranked, answer, search, told.weighing)


def _explain_by(context: SearchContext, candidates: Candidates) -> Explanations:
    ranked, search = rank_candidates(context, candidates), _as_far_as(context, candidates)
    best = next((one for one in ranked if one.inside), None)
    answer = None if best is None else _answer(context, best)
    return Explanations(tuple(ranked), answer, search)


def _as_far_as(context: SearchContext, candidates: Candidates) -> SearchReport:
    """Return how the search went; what the deadline left unranked may have been better."""
    return replace(candidates.report, complete=False) if context.deadline.passed else candidates.report


def _answer(context: SearchContext, best: Ranked) -> Answer | None:
    accepted = accept(context, best)
    (settled,) = settle(context, [best], hinges=True)
    if settled.views is not None:
        # What is told of it holds where the views are found to have been.
        context = replace(context, scan=corrected(context.scan, settled.views.found, settled.views.spread))
    registered = register_accepted(context, accepted, settled)
    if registered is None:
        return None
    chance = significance(context, worth_of(best.matches))
    beams = compare_beams(context, settled)
    return Answer(best, accepted, settled, registered, agreement(context, best), beams, chance)
