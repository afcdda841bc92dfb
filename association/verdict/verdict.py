"""From the explanations to one verdict: how likely the best one is right, whether a robot may use it, and why not."""

from __future__ import annotations

from dataclasses import replace

from registration import RigidTransform
from registration.values import value

from ..consensus.ranking import with_lines_of_sight
from ..consensus.tuning import CONTRADICTION
from ..context import SearchContext
from ..explanations import Answer, Explanations
from ..result import Reason, Status
from .probabilities import Probabilities, least_cautious, work_out_probabilities
from .reasons import INCOMPLETE, SENTENCES, Doubts, reasons_of
from .tuning import (
    CONTRADICTED,
    ELSEWHERE_PROBABILITY,
    FAR_FROM_PRIOR,
    LEAST_IN_STEP,
    NO_MATCH_PROBABILITY,
    USABLE_PROBABILITY,
)
from .unobservable import choose_along_direction


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
    contradicted : bool
        True if the prior contradicts the pose.
    reasons : tuple of Reason
        Why it is not usable, the weightiest first.
    complete : bool
        True if the deadline ended neither the search nor the comparison of its result.
    cautious : float
        Probability that the pose is right where other buildings are included; 0 without an answer.
    """

    status: Status
    probability: float | None
    usable: bool
    pose: RigidTransform | None
    margin: float | None
    runner_up: float | None
    contradicted: bool
    reasons: tuple[Reason, ...]
    complete: bool
    cautious: float = 0.0

    def cut_short(self) -> Verdict:
        """Return the same, not usable, where something was left undone."""
        if not self.complete:
            return self
        reasons = (Reason(INCOMPLETE, SENTENCES[INCOMPLETE]), *self.reasons)
        return replace(self, usable=False, complete=False, reasons=reasons)


def judge(context: SearchContext, explanations: Explanations, *, off_scale: bool = False) -> Verdict:
    """Judge the best explanation.

    1. Note what speaks against it whatever its probability: the prior, scale, the last view of a drive.
    2. Work out its probabilities: features, models, alternatives, null score.
    3. Decide the status, and list the reasons where it is not usable.

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
    answer, complete = explanations.answer, explanations.search.complete
    if answer is None:
        return _no_match(explanations)
    best = answer.best
    better_elsewhere = any(other.score > best.score + CONTRADICTION for other in explanations.others)
    contradicted = better_elsewhere or best.posterior - best.score < FAR_FROM_PRIOR
    doubted = off_scale or _out_of_step(answer)
    certain = complete and not contradicted and context.window is None and not doubted
    found = work_out_probabilities(context, explanations, answer, capped=better_elsewhere, certain=certain)
    # The mirrored scan and the alternatives with walls farther off are searched, and scored, no further than the
    # deadline.
    complete = complete and not context.deadline.passed
    status = _status(
        answer, found, least_cautious(context), capped=better_elsewhere, doubted=doubted or found.few_walls
    )
    pose = choose_along_direction(context, answer)
    if context.window is not None and pose is not None and not context.window.contains(pose):
        # It was inside before it was registered: the window is narrower than the error of the pose.
        contradicted = contradicted or status is not Status.NO_MATCH
    usable = status is Status.OK and complete and not contradicted
    doubts = _doubts(explanations, answer, found, status, complete=complete, contradicted=contradicted)
    margin, runner_up = _margin(context, explanations, answer)
    return Verdict(
        status=status,
        probability=_probability(status, found.right, contradicted=contradicted),
        usable=usable,
        pose=pose,
        margin=margin,
        runner_up=runner_up,
        contradicted=contradicted,
        reasons=() if usable else reasons_of(replace(doubts, off_scale=off_scale), found.features, found.model),
        complete=complete,
        cautious=found.cautious,
    )


def _no_match(explanations: Explanations) -> Verdict:
    """Return the verdict where nothing explains the scan within the prior's window."""
    complete, outside = explanations.search.complete, bool(explanations.ranked)
    reasons = reasons_of(Doubts(Status.NO_MATCH, complete, outside, not_on_map=True), None, None)
    return Verdict(Status.NO_MATCH, 0.0, False, None, None, None, outside, reasons, complete)


def _margin(context: SearchContext, explanations: Explanations, answer: Answer) -> tuple[float | None, float | None]:
    """Return by how much the best explanation is better than the next, nats, and that one's score over the best's."""
    nearest = next(with_lines_of_sight(context, explanations.ranked, explanations.alternatives), None)
    if nearest is None:
        return None, None
    best = answer.best.posterior
    return best - nearest.posterior, None if not best > 0.0 else max(0.0, nearest.posterior / best)


def _probability(status: Status, right: float, *, contradicted: bool) -> float | None:
    """Return the probability that the pose is right; along an unobservable direction there is none.

    The features are evidence of whether the walls that fix the pose are right. The pose along them is a choice.
    """
    if status is Status.DEGENERATE:
        return None
    return min(right, CONTRADICTED) if contradicted else right


def _doubts(
    explanations: Explanations,
    answer: Answer,
    found: Probabilities,
    status: Status,
    *,
    complete: bool,
    contradicted: bool,
) -> Doubts:
    """Return the evidence against an answer, except for its features."""
    return Doubts(
        status,
        complete,
        contradicted,
        not_on_map=found.explained < ELSEWHERE_PROBABILITY,
        few_walls=found.few_walls,
        similar_place=found.among_alternatives < USABLE_PROBABILITY,
        alone=next(explanations.alternatives, None) is None,
        mirrored=found.mirrored,
        out_of_step=_out_of_step(answer),
    )


def _out_of_step(answer: Answer) -> bool:
    """Return whether the last view of a drive fits far worse than those before it: then its own place is not known."""
    return answer.beams.in_step < LEAST_IN_STEP


def _status(answer: Answer, found: Probabilities, bar: float, *, capped: bool, doubted: bool) -> Status:
    """Decide in order of precedence; a `capped` probability is never enough."""
    if found.explained < NO_MATCH_PROBABILITY:
        return Status.NO_MATCH
    if answer.estimated.degenerate:
        return Status.DEGENERATE
    likely = found.right >= USABLE_PROBABILITY and not capped
    sure = found.cautious >= bar and not doubted and not found.mirrored
    return Status.OK if likely and sure else Status.AMBIGUOUS
