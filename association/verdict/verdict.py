"""From the explanations to one verdict: how likely the best one is right, whether a robot may go by it, and why not."""

from __future__ import annotations

from dataclasses import replace

from registration import RigidTransform
from registration.layout import Records
from registration.values import value

from ..consensus.ranking import Ranked, with_lines_of_sight
from ..context import SearchContext
from ..explanations import Answer, Explanations
from ..result import Reason, Status
from ..tuning import (
    CONTRADICTED,
    CONTRADICTION,
    ELSEWHERE_PROBABILITY,
    FAR_FROM_PRIOR,
    LEAST_IN_STEP,
    MIRRORED_BETTER,
    NO_MATCH_PROBABILITY,
    USABLE_CAUTIOUS,
    USABLE_CAUTIOUS_DRIVE,
    USABLE_CAUTIOUS_WITH_BEAMS,
    USABLE_PROBABILITY,
)
from .families import place_on_family
from .features import Features, describe, facts_of, is_thin, take_null, twin_share, weigh
from .kernels import odds
from .loosening import loose_twin_share
from .models import MODELS, USUAL, Model
from .null import null_of
from .reasons import INCOMPLETE, SENTENCES, Standing, reasons_of

_allowed_null = odds.allowed_null
_chance = odds.chance


@value(frozen=True, slots=True)
class Verdict:
    """What the evidence comes to.

    Attributes
    ----------
    status : Status
    probability : float or None
        That the pose is right, 0 to 1; None where the position is open along a direction.
    usable : bool
    pose : RigidTransform or None
        In the map frame; of a family the member that is answered.
    margin : float or None
        Value of the best explanation less that of the next, nats; None where no other was found, which says nothing of
        poses below `SearchReport.complete_above` of the score.
    runner_up : float or None
        Value of the next over that of the best, never below 0.
    contradicted : bool
        Whether the prior says that the robot is elsewhere.
    reasons : tuple of Reason
        Why it is not usable, the weightiest first.
    complete : bool
        Whether neither the search nor what it was compared with was ended by the deadline.
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
    """Weigh the best explanation against the others and against none being right.

    `off_scale`: whether scan and map differ by a factor that nothing was done about.
    """
    answer, complete = explanations.answer, explanations.search.complete
    if answer is None:
        why = reasons_of(
            Standing(Status.NO_MATCH, complete, bool(explanations.ranked), elsewhere=True),
            None,
            None,
        )
        return Verdict(Status.NO_MATCH, 0.0, False, None, None, None, bool(explanations.ranked), why, complete)
    best = answer.best
    better_elsewhere = any(other.score > best.score + CONTRADICTION for other in explanations.others)
    contradicted = better_elsewhere or best.value - best.score < FAR_FROM_PRIOR
    doubted = off_scale or _out_of_step(answer)
    certain = complete and not contradicted and context.window is None and not doubted
    chances = _Chances.of(context, explanations, capped=better_elsewhere, certain=certain)
    # The mirrored scan and the rivals with walls farther off are searched, and scored, no further than the deadline.
    complete = complete and not context.deadline.passed
    status = _status(answer, chances, _bar(context), capped=better_elsewhere, doubted=doubted or chances.thin)
    pose = place_on_family(context, answer)
    if context.window is not None and pose is not None and not context.window.contains(pose):
        # It was inside before it was registered: the window is narrower than what the scan says.
        contradicted = contradicted or status is not Status.NO_MATCH
    usable, rival = status is Status.OK and complete and not contradicted, next(explanations.rivals, None)
    nearest = next(with_lines_of_sight(context, explanations.ranked, explanations.rivals), None)
    return Verdict(
        status=status,
        probability=_probability(status, chances.right, contradicted=contradicted),
        usable=usable,
        pose=pose,
        margin=None if nearest is None else best.value - nearest.value,
        runner_up=None if nearest is None or not best.value > 0.0 else max(0.0, nearest.value / best.value),
        contradicted=contradicted,
        reasons=() if usable else _reasons(answer, rival, chances, status, complete, contradicted, off_scale=off_scale),
        complete=complete,
        cautious=chances.careful,
    )


def _probability(status: Status, right: float, *, contradicted: bool) -> float | None:
    """Return the probability that the pose is right; of a family of poses, of which one is answered, there is none.

    The features say whether the walls that fix the pose are the right ones, and the pose along them is a choice.
    """
    if status is Status.DEGENERATE:
        return None
    return min(right, CONTRADICTED) if contradicted else right


def _reasons(
    answer: Answer,
    rival: Ranked | None,
    chances: _Chances,
    status: Status,
    complete: bool,
    contradicted: bool,
    *,
    off_scale: bool,
) -> tuple[Reason, ...]:
    standing = Standing(
        status,
        complete,
        contradicted,
        elsewhere=chances.explained < ELSEWHERE_PROBABILITY,
        thin=chances.thin,
        twin=chances.share < USABLE_PROBABILITY,
        alone=rival is None,
        mirrored=chances.mirrored,
        out_of_step=_out_of_step(answer),
        off_scale=off_scale,
    )
    return reasons_of(standing, Features(*chances.features.item()), chances.cautious)


@value(frozen=True, slots=True)
class _Chances:
    """Chances of an answer, 0 to 1.

    Attributes
    ----------
    right : float
        That the pose is right, given that the robot is on this map.
    careful : float
        The same where other buildings are reckoned with.
    explained : float
        That this or a twin of it is right, wherever along a free direction, other buildings reckoned with.
    share : float
        Of the answer among the explanations that are about as good; it is in `right` and `careful`.
    thin : bool
        Whether few walls fix the pose, and one of them alone decides.
    features : (1,) of `FEATURES`
        What these come from; with the null where it was needed and matters.
    cautious : Model
        By which the careful one does.
    """

    right: float
    careful: float
    explained: float
    share: float
    thin: bool
    features: Records
    cautious: Model

    @classmethod
    def of(cls, context: SearchContext, explanations: Explanations, *, capped: bool, certain: bool) -> _Chances:
        """Work out those of an answer; `certain`: whether it is usable if they suffice."""
        form = "_with_beams" if context.with_beams else ""
        usual, cautious = MODELS["probability" + form], MODELS["cautious" + form]
        answer = explanations.answer
        assert answer is not None
        best, rivals = answer.best, tuple(explanations.rivals)
        weighed, facts = weigh(best, rivals), facts_of(context, answer)
        features, share = describe(best, facts, weighed), twin_share(weighed)
        # Whether the scan is of this map is another question than whether it fixes the position, and where on it.
        fixed = features.copy()
        fixed["deviation"] = USUAL.deviation
        right, careful, explained = (
            _chance(model.odds, numbers)
            for model, numbers in ((usual, features), (cautious, features), (cautious, fixed))
        )
        likely, thin = right * share >= USABLE_PROBABILITY and not capped, is_thin(context, answer, facts)
        decidable = not answer.settled.degenerate and not thin
        if likely and decidable and careful * share >= _bar(context):
            share = min(share, loose_twin_share(context, answer, rivals))
        if likely and decidable and careful * share >= _bar(context):
            # Only what would be usable has to stand up to the mirrored scan, which costs another search. Where it is
            # usable nothing else is told of the null; where it is not, the reasons go by what it comes to.
            certain = certain and right * share >= USABLE_PROBABILITY
            bar = _bar(context) / share
            allowed = _allowed_null(cautious.odds, features.copy(), best.score, bar) if certain else 0.0
            take_null(features, best, null_of(context, best, allowed))
            careful = _chance(cautious.odds, features)
        return cls(right * share, careful * share, explained, share, thin, features, cautious)

    @property
    def mirrored(self) -> bool:
        """Whether the scan fits the map better with left and right exchanged."""
        return bool(self.features["null_better"][0] >= MIRRORED_BETTER)


def _out_of_step(answer: Answer) -> bool:
    """Tell whether the last view of a drive fits far worse than those before it: then its own place is not known."""
    return answer.beams.in_step < LEAST_IN_STEP


def _bar(context: SearchContext) -> float:
    """Return what the cautious probability has to reach."""
    if context.scan.views is not None and context.scan.views.uncertain:
        return USABLE_CAUTIOUS_DRIVE
    return USABLE_CAUTIOUS_WITH_BEAMS if context.with_beams else USABLE_CAUTIOUS


def _status(answer: Answer, chances: _Chances, bar: float, *, capped: bool, doubted: bool) -> Status:
    """Decide in order of precedence; a `capped` probability is never enough."""
    if chances.explained < NO_MATCH_PROBABILITY:
        return Status.NO_MATCH
    if answer.settled.degenerate:
        return Status.DEGENERATE
    likely = chances.right >= USABLE_PROBABILITY and not capped
    sure = chances.careful >= bar and not doubted and not chances.mirrored
    return Status.OK if likely and sure else Status.AMBIGUOUS
