"""From the explanations to one verdict: how likely the best one is right, whether a robot may use it, and why not."""

from __future__ import annotations

import math
from dataclasses import replace

from registration import RigidTransform
from registration.values import value

from ..consensus.ranking import with_lines_of_sight
from ..context import SearchContext
from ..explanations import Answer, Explanations
from ..result import Reason, Status
from .features import Description, describe_answer
from .inconsistencies import displaced_walls, turn_during_scan
from .probabilities import Probabilities, work_out_probabilities
from .reasons import REASON_MESSAGES, Doubts, reasons_of
from .tuning import CONTRADICTED, ELSEWHERE_PROBABILITY, NO_MATCH_PROBABILITY
from .unobservable import beyond_tolerance, choose_along_direction
from .vetoes import INCOMPLETE, VETOES, Findings, Veto, applied, contradict_prior, counted


@value(frozen=True, slots=True)
class Verdict:
    """The verdict on the best explanation: whether it is right, and may be used.

    Attributes
    ----------
    status : Status
    probability : float or None
        That the pose is right, 0 to 1; None where the position is open along a direction.
    usable : bool
    pose : RigidTransform or None
        In the map frame; along an unobservable direction the one that was chosen.
    margin : float or None
        Score and prior of the best explanation less those of the next, nats; None where no other was found. There
        may be others below `SearchReport.complete_above` of the score.
    runner_up : float or None
        Those of the next over those of the best, never below 0.
    reasons : tuple of Reason
        Why it is not usable, the weightiest first.
    vetoes : tuple of Veto
        Those that apply and count with the status, in the order of `vetoes.VETOES`.
    description : Description or None
        The answer by its features; None without an answer.
    probabilities : Probabilities or None
        The numbers behind `probability`; likewise.
    """

    status: Status
    probability: float | None
    usable: bool
    pose: RigidTransform | None
    margin: float | None
    runner_up: float | None
    reasons: tuple[Reason, ...]
    vetoes: tuple[Veto, ...] = ()
    description: Description | None = None
    probabilities: Probabilities | None = None

    @property
    def complete(self) -> bool:
        """Return whether the deadline ended neither the search nor the comparison of its result."""
        return INCOMPLETE not in self.vetoes

    @property
    def contradicted(self) -> bool:
        """Return whether the prior contradicts the pose."""
        return contradict_prior(self.vetoes)

    def cut_short(self) -> Verdict:
        """Return the same, not usable, where something was left undone."""
        if not self.complete:
            return self
        reasons = (*(Reason(code, REASON_MESSAGES[code]) for code in INCOMPLETE.reasons), *self.reasons)
        vetoes = tuple(veto for veto in VETOES if veto in (*self.vetoes, INCOMPLETE))
        return replace(self, usable=False, vetoes=vetoes, reasons=reasons)


def judge(context: SearchContext, explanations: Explanations, *, off_scale: bool = False) -> Verdict:
    """Judge the best explanation.

    1. Describe it by features, among its alternatives.
    2. Evaluate the models: how probable it is.
    3. Apply the vetoes.
    4. Decide the status.
    5. List the reasons, if it is not usable.

    Parameters
    ----------
    context : SearchContext
    explanations : Explanations
    off_scale : bool
        True if scan and map differ by a factor that was not corrected.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    answer = explanations.answer
    if answer is None:
        return _no_match(explanations)
    description = describe_answer(context, explanations, answer)
    findings = findings_of(context, explanations, description, off_scale=off_scale)
    found = work_out_probabilities(context, description, applied(findings))
    pose = choose_along_direction(context, answer)
    vetoes = applied(_all_findings(context, findings, found, pose))
    status = _status(found, vetoes, context.options.usable_from)
    vetoes = counted(vetoes, status)
    usable = status is Status.OK and not vetoes
    margin, runner_up = _margin(context, explanations, answer)
    return Verdict(
        status=status,
        probability=_probability(status, found.right, contradicted=contradict_prior(vetoes)),
        usable=usable,
        pose=pose,
        margin=margin,
        runner_up=runner_up,
        reasons=() if usable else _reasons(context, description, found, status, vetoes),
        vetoes=vetoes,
        description=description,
        probabilities=found,
    )


def _no_match(explanations: Explanations) -> Verdict:
    """Return the verdict where nothing explains the scan within the prior's window."""
    vetoes = counted(
        applied(Findings(explanations.search.complete, score_elsewhere=_best(explanations))), Status.NO_MATCH
    )
    reasons = reasons_of(Doubts(Status.NO_MATCH, vetoes, not_on_map=True), None, None)
    return Verdict(Status.NO_MATCH, 0.0, False, None, None, None, reasons, vetoes)


def _best(explanations: Explanations) -> float:
    """Return the best score of the other explanations, also outside the prior's window, nats."""
    return max((other.score for other in explanations.others), default=-math.inf)


def findings_of(
    context: SearchContext, explanations: Explanations, description: Description, *, off_scale: bool
) -> Findings:
    """Return what the vetoes need, as far as it is known before the probabilities."""
    answer = description.answer
    return Findings(
        complete=explanations.search.complete,
        score=answer.best.score,
        score_elsewhere=_best(explanations),
        prior=answer.best.posterior - answer.best.score,
        unobservable=answer.estimated.degenerate,
        few_walls=description.few_walls,
        in_step=answer.beams.in_step,
        off_scale=off_scale,
        beyond_tolerance=beyond_tolerance(context, answer),
        displaced_walls=displaced_walls(context, answer.best),
        turned=turn_during_scan(context, answer.best),
    )


def _all_findings(
    context: SearchContext, findings: Findings, found: Probabilities, pose: RigidTransform | None
) -> Findings:
    """Return all that the vetoes need.

    The mirrored scan and the alternatives with walls farther off are searched, and scored, no further than the
    deadline. The explanation was inside the window before its pose was registered: the window may be narrower than the
    error of the pose.
    """
    window = context.window
    return replace(
        findings,
        complete=findings.complete and not context.deadline.passed,
        outside_window=window is not None and pose is not None and not window.contains(pose),
        mirrored_better=found.features.null_better,
    )


def _margin(context: SearchContext, explanations: Explanations, answer: Answer) -> tuple[float | None, float | None]:
    """Return by how much the best explanation is better than the next, nats, and that one's score over the best's."""
    nearest = next(with_lines_of_sight(context, explanations.ranked, explanations.alternatives), None)
    if nearest is None:
        return None, None
    best = answer.best.posterior
    return max(0.0, best - nearest.posterior), None if not best > 0.0 else max(0.0, nearest.posterior / best)


def _probability(status: Status, right: float, *, contradicted: bool) -> float | None:
    """Return the probability that the pose is right; along an unobservable direction there is none.

    The features are evidence of whether the walls that fix the pose are right. The pose along them is a choice.
    """
    if status is Status.DEGENERATE:
        return None
    return min(right, CONTRADICTED) if contradicted else right


def _reasons(
    context: SearchContext, description: Description, found: Probabilities, status: Status, vetoes: tuple[Veto, ...]
) -> tuple[Reason, ...]:
    """List why an answer is not usable."""
    doubts = Doubts(
        status,
        vetoes,
        not_on_map=found.explained < ELSEWHERE_PROBABILITY,
        similar_place=found.among.least < context.options.usable_from,
        alone=not description.others,
    )
    return reasons_of(doubts, found.features, found.model)


def _status(found: Probabilities, vetoes: tuple[Veto, ...], usable_from: float) -> Status:
    """Decide in order of precedence."""
    if found.explained < NO_MATCH_PROBABILITY:
        return Status.NO_MATCH
    caps = [veto.caps for veto in vetoes if veto.caps is not None]
    if Status.DEGENERATE in caps:
        return Status.DEGENERATE
    return Status.OK if found.right >= usable_from and not caps else Status.AMBIGUOUS
