"""From a prepared search to its explanations, and the best of them worked out: all that the verdict weighs."""

from __future__ import annotations

from dataclasses import replace

from registration import RegistrationResult, RigidTransform
from registration.values import value

from .acceptance import Accepted, accept, register_accepted
from .candidates import Candidates, Effort, find_candidates
from .context import SearchContext
from .layout import FOUND, record
from .ranking import Ranked, rank_candidates
from .result import SearchReport
from .settling import Settled, settle
from .sight import BeamShares, agreement, compare_beams
from .significance import significance
from .views import corrected

NOT_SEARCHED = SearchReport(False, False, 0.0, 0, 0, 0, 0, "ordered", 1.0)


@value(frozen=True, slots=True)
class Answer:
    """The best explanation, worked out.

    Attributes
    ----------
    best : Ranked
    accepted : Accepted
        Its consensus set in the map's own segments.
    settled : Settled
        Its pose, and what that hinges on.
    registered : RegistrationResult
        That pose on the map's own segments.
    agreement : float
        Share of directions in which the scan shows what the map does, 0 to 1.
    beams : BeamShares
        How many of the beams do not read what the map shows.
    significance : float
        Probability that chance scores as high.
    """

    best: Ranked
    accepted: Accepted
    settled: Settled
    registered: RegistrationResult
    agreement: float
    beams: BeamShares
    significance: float


@value(frozen=True, slots=True)
class Explanations:
    """What a search found.

    Attributes
    ----------
    ranked : tuple of Ranked
        Distinct; those within a hard prior's window first, the best first.
    answer : Answer or None
        The first within the window; None where there is none.
    search : SearchReport
    """

    ranked: tuple[Ranked, ...]
    answer: Answer | None
    search: SearchReport

    @property
    def rivals(self) -> tuple[Ranked, ...]:
        """The other explanations within the window, best first."""
        return tuple(one for one in self.others if one.inside)

    @property
    def others(self) -> tuple[Ranked, ...]:
        """All explanations but that of the answer."""
        return self.ranked if self.answer is None else tuple(r for r in self.ranked if r is not self.answer.best)


def explain(context: SearchContext, effort: Effort | None = None) -> Explanations:
    """Search, rank what was found, and work out the best of it; by default with the effort that the context wants.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
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


def _explain_by(context: SearchContext, candidates: Candidates) -> Explanations:
    ranked = rank_candidates(context, candidates)
    # What the deadline left unranked may have been better.
    search = replace(candidates.report, complete=False) if context.deadline.passed else candidates.report
    best = next((one for one in ranked if one.inside), None)
    return Explanations(tuple(ranked), None if best is None else _answer(context, best), search)


def _answer(context: SearchContext, best: Ranked) -> Answer | None:
    accepted = accept(context, best)
    (settled,) = settle(context, [best], hinges=True)
    if settled.views is not None:
        # What is told of it holds where the views are found to have been.
        context = replace(context, scan=corrected(context.scan, settled.views.found, settled.views.spread))
    registered = register_accepted(context, accepted, settled)
    if registered is None:
        return None
    chance = significance(context, float(best.matches["worth"].sum()))
    beams = compare_beams(context, settled)
    return Answer(best, accepted, settled, registered, agreement(context, best), beams, chance)
