"""From the explanations to one verdict: how likely the best one is right, whether a robot may use it, and why not."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from registration import RigidTransform

from ..context import SearchContext
from ..explanations import Answer, Explanations
from ..result import Reason, ReasonCode, Status
from .alternatives import Comparison, compare
from .features import Described, describe, with_null
from .model import MODELS, Model
from .null import find_null
from .reasons import INCOMPLETE, VETOES, Findings, Veto, applied, reasons_of, weighed_reasons
from .tuning import CONTRADICTED, NO_MATCH_PROBABILITY
from .unobservable import choose_along_direction

NEUTRAL = 0.5  # prior probability at which it is judged whether a scan is of the map at all


@dataclass(frozen=True, slots=True)
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
    reasons : tuple of Reason
        Why it is not usable, the weightiest first.
    vetoes : tuple of Veto
        Those that apply, in the order of the table.
    model : Model or None
    described : Described or None
        The answer by its features; None without an answer.
    by_model : float
        The probability by the model alone, before the alternatives are counted.
    explained : float
        Probability that the scan is of this place or a similar one, with even odds of being elsewhere.
    score : float
        Of the answer, nats.
    searched_null : bool
        True if the mirrored scan was searched.
    """

    status: Status
    probability: float | None
    usable: bool
    pose: RigidTransform | None
    reasons: tuple[Reason, ...]
    vetoes: tuple[Veto, ...] = ()
    model: Model | None = None
    described: Described | None = None
    by_model: float = 0.0
    explained: float = 0.0
    score: float = 0.0
    searched_null: bool = False

    @property
    def complete(self) -> bool:
        """Return whether the deadline ended neither the search nor the comparison of its result."""
        return INCOMPLETE not in self.vetoes

    @property
    def contradicted(self) -> bool:
        """Return whether the prior contradicts the pose."""
        return any(veto.reason == "prior_contradicted" for veto in self.vetoes)

    @property
    def comparison(self) -> Comparison | None:
        """Return the comparison with the alternatives."""
        return None if self.described is None else self.described.comparison

    def cut_short(self) -> Verdict:
        """Return the same, not usable, where something was left undone."""
        if not self.complete:
            return self
        vetoes = tuple(veto for veto in VETOES if veto in (*self.vetoes, INCOMPLETE))
        codes = tuple(reason for reason in self.reasons if reason.code != INCOMPLETE.reason)
        return replace(self, usable=False, vetoes=vetoes, reasons=(*reasons_of(self.status, (INCOMPLETE,), ()), *codes))


def judge(context: SearchContext, explanations: Explanations) -> Verdict:
    """Judge the best explanation.

    1. Compare it with its alternatives, and describe it by features.
    2. Evaluate the model: how probable it is, with the prior probability ``options.on_map``.
    3. If it would be usable, search the mirrored scan, and evaluate the model again.
    4. Apply the vetoes of the contract, and decide the status.
    5. List the reasons, if it is not usable.

    Parameters
    ----------
    context : SearchContext
    explanations : Explanations

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    answer = explanations.answer
    if answer is None:
        vetoes = applied(Findings(explanations.search.complete, score_elsewhere=_best(explanations)))
        return Verdict(Status.NO_MATCH, 0.0, False, None, reasons_of(Status.NO_MATCH, vetoes, ["not_on_map"]), vetoes)
    on_map, usable_from = context.options.on_map, context.options.usable_from
    model = MODELS["ranges" if context.with_beams else "segments"]
    others = [one for one in explanations.others if one.inside]
    comparison = compare(context, answer.best, others, answer.estimate.wall_sigma)
    described = describe(context, answer.best, answer.estimate, comparison)
    findings = findings_of(explanations, answer)
    probability = model.probability(described.features, on_map) * comparison.probability
    would_be = probability >= usable_from and not applied(findings)
    if would_be:
        described = with_null(described, answer.best, find_null(context, answer.best))
        probability = model.probability(described.features, on_map) * comparison.probability
    pose = choose_along_direction(context, answer)
    window = context.window
    vetoes = applied(
        replace(
            findings,
            complete=findings.complete and not context.deadline.passed,
            outside_window=window is not None and not window.contains(pose),
        )
    )
    explained = 1.0 - model.elsewhere_probability(described.features, NEUTRAL)
    status = _status(explained, probability, findings, vetoes, usable_from)
    contradicted = any(veto.reason == "prior_contradicted" for veto in vetoes)
    usable = status is Status.OK and not vetoes
    if status is Status.NO_MATCH:
        probability = 0.0
    verdict = Verdict(
        status=status,
        probability=None if status is Status.DEGENERATE else min(probability, CONTRADICTED if contradicted else 1.0),
        usable=usable,
        pose=None if status is Status.NO_MATCH else pose,
        reasons=(),
        vetoes=vetoes,
        model=model,
        described=described,
        by_model=model.probability(described.features, on_map),
        explained=explained,
        score=answer.best.score,
        searched_null=would_be,
    )
    return verdict if usable else replace(verdict, reasons=_reasons(verdict, on_map, usable_from))


def findings_of(explanations: Explanations, answer: Answer) -> Findings:
    """Return what the vetoes need, as far as it is known before the pose is chosen."""
    return Findings(
        complete=explanations.search.complete,
        score=answer.best.score,
        score_elsewhere=_best(explanations),
        prior=answer.best.posterior - answer.best.score,
        unobservable=answer.estimate.degenerate,
    )


def _best(explanations: Explanations) -> float:
    """Return the best score of the other explanations, also outside the prior's window, nats."""
    return max((other.score for other in explanations.others), default=-math.inf)


def _status(
    explained: float, probability: float, findings: Findings, vetoes: tuple[Veto, ...], usable_from: float
) -> Status:
    """Decide in order of precedence."""
    if explained < NO_MATCH_PROBABILITY:
        return Status.NO_MATCH
    if findings.unobservable:
        return Status.DEGENERATE
    caps = any(veto.name == "better_elsewhere" for veto in vetoes)
    return Status.OK if probability >= usable_from and not caps else Status.AMBIGUOUS


def _reasons(verdict: Verdict, on_map: float, usable_from: float) -> tuple[Reason, ...]:
    """List why an answer is not usable."""
    assert verdict.described is not None
    assert verdict.model is not None
    settled: list[ReasonCode] = []
    if verdict.status is Status.NO_MATCH:
        settled.append("not_on_map")
    if verdict.described.comparison.probability < usable_from and verdict.status is Status.AMBIGUOUS:
        settled.append("similar_place")
    weighed: list[ReasonCode] = []
    if verdict.status is Status.AMBIGUOUS and (verdict.probability or 0.0) < usable_from:
        weighed = weighed_reasons(
            verdict.model, verdict.described.features, on_map, verdict.described.comparison.probability
        )
        # Two probabilities that each reach the threshold may miss it together.
        weighed = weighed if verdict.by_model < usable_from or not settled else []
    vetoes = [
        veto
        for veto in verdict.vetoes
        if veto.reason != "unobservable_direction" or verdict.status is Status.DEGENERATE
    ]
    return reasons_of(verdict.status, vetoes, settled, weighed)
