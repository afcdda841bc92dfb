"""From the explanations to one verdict, and the chance that the best one is right."""

from __future__ import annotations

import math
from dataclasses import dataclass

from registration import RigidTransform

from .context import SearchContext
from .explain import Answer, Explanations
from .families import is_degenerate, place_on_family
from .features import features_of, twin_share
from .models import CAUTIOUS, PROBABILITY, WITH_BEAMS
from .ranking import Ranked
from .result import Status
from .tuning import (
    CHANCE,
    CONTRADICTED,
    CONTRADICTION,
    FAR_FROM_PRIOR,
    FEWEST,
    LIKELY_BY_CHANCE,
    MOSTLY,
    NO_MATCH_PROBABILITY,
    USABLE_BY_CHANCE,
    USABLE_CAUTIOUS,
    USABLE_PROBABILITY,
)


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the evidence comes to.

    Attributes
    ----------
    status : Status
    probability : float
        That the pose is right, 0 to 1.
    usable : bool
    pose : RigidTransform or None
        In the map frame; of a family the member that is answered.
    margin : float or None
        Value of the best explanation less that of the next, nats; None when there is no other.
    runner_up : float or None
        Value of the next over that of the best, never below 0.
    contradicted : bool
        Whether the prior says that the robot is elsewhere.
    """

    status: Status
    probability: float
    usable: bool
    pose: RigidTransform | None
    margin: float | None
    runner_up: float | None
    contradicted: bool


def judge(context: SearchContext, explanations: Explanations) -> Verdict:
    """Weigh the best explanation against the others and against none being right."""
    answer, rivals = explanations.answer, explanations.rivals
    if answer is None:
        return Verdict(Status.NO_MATCH, 0.0, False, None, None, None, bool(explanations.ranked))
    best = answer.best
    better_elsewhere = any(other.score > best.score + CONTRADICTION for other in explanations.others)
    contradicted = better_elsewhere or best.value - best.score < FAR_FROM_PRIOR
    chances = _Chances.of(context, answer, rivals)
    status = _status(answer, chances, with_beams=context.with_beams, capped=better_elsewhere)
    pose = place_on_family(context, answer) if status is Status.DEGENERATE else answer.registered.pose
    if context.window is not None and pose is not None and not context.window.contains(pose):
        # It was inside before it was registered: the window is narrower than what the scan says.
        contradicted = contradicted or status is not Status.NO_MATCH
    return Verdict(
        status=status,
        probability=min(chances.right, CONTRADICTED) if contradicted else chances.right,
        usable=status is Status.OK and explanations.search.complete and not contradicted,
        pose=pose,
        margin=best.value - rivals[0].value if rivals else None,
        runner_up=max(0.0, rivals[0].value / best.value) if rivals and best.value > 0.0 else None,
        contradicted=contradicted,
    )


@dataclass(frozen=True, slots=True)
class _Chances:
    """Chances of an answer, 0 to 1.

    Attributes
    ----------
    right : float
        That the pose is right, given that the robot is on this map.
    careful : float
        The same where other buildings are reckoned with.
    explained : float
        That this or a twin of it is right, wherever along a free direction.
    """

    right: float
    careful: float
    explained: float

    @classmethod
    def of(cls, context: SearchContext, answer: Answer, rivals: tuple[Ranked, ...]) -> _Chances:
        features = features_of(context, answer, rivals)
        share = twin_share(answer.best, rivals)
        usual, cautious = (WITH_BEAMS, WITH_BEAMS) if context.with_beams else (PROBABILITY, CAUTIOUS)
        right, careful = usual.logit(features), cautious.logit(features)
        # Whether anything explains the scan is another question than whether it fixes the position.
        explained = _logistic(right - usual.coefficient("deviation") * features.deviation)
        if answer.significance > CHANCE:
            explained = min(explained, _logistic(careful - cautious.coefficient("deviation") * features.deviation))
        return cls(_logistic(right) * share, _logistic(careful) * share, explained)


def _logistic(logit: float) -> float:
    return 1.0 / (1.0 + math.exp(-logit))


def _status(answer: Answer, chances: _Chances, *, with_beams: bool, capped: bool) -> Status:
    """Decide in order of precedence; a `capped` probability is never enough."""
    if chances.explained < NO_MATCH_PROBABILITY:
        return Status.NO_MATCH
    if is_degenerate(answer.registered):
        return Status.DEGENERATE
    likely = chances.right >= USABLE_PROBABILITY and not capped
    sure = chances.careful >= _bar(answer.significance, with_beams=with_beams)
    return Status.OK if likely and sure and not _is_thin(answer.best) else Status.AMBIGUOUS


def _bar(significance: float, *, with_beams: bool) -> float:
    """Return what the cautious probability has to reach."""
    if significance > LIKELY_BY_CHANCE:
        return USABLE_BY_CHANCE
    return USABLE_PROBABILITY if with_beams else USABLE_CAUTIOUS


def _is_thin(best: Ranked) -> bool:
    """Tell whether a corner is all that fits, and most of the scan does not: any building has one."""
    return int(best.matched.sum()) < FEWEST and best.share < MOSTLY
