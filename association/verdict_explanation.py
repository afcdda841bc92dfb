"""Explain a verdict number by number: features, contributions, alternatives, null score, vetoes, thresholds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from registration import RigidTransform

from .associating import DEFAULT_OPTIONS, run_stages
from .context import SearchContext
from .deadline import Deadline
from .index.map_index import MapIndex
from .options import AssociationOptions, Prior
from .result import AssociationResult, Reason, ReasonCode, Status
from .scan.scan import Scan
from .verdict.alternatives import AmongAlternatives
from .verdict.features import Description
from .verdict.models import USUAL
from .verdict.probabilities import Probabilities
from .verdict.reasons import taken_by_reason
from .verdict.roles import ROLES
from .verdict.tuning import NO_MATCH_PROBABILITY
from .verdict.verdict import Verdict
from .verdict.vetoes import VETOES, Origin


@dataclass(frozen=True, slots=True)
class Contribution:
    """The term of one feature, or of a pair of features, in the logarithm of the odds.

    Attributes
    ----------
    name : str
        Of the feature; of a pair its kind and both names.
    value : float or None
        Of the feature; None for a pair.
    nats : float
        The term.
    usual : float
        The same term of a usual right answer, nats.
    reason : str or None
        The reason that the feature speaks for where its term is lower than usual; None for the constant and pairs.
    """

    name: str
    value: float | None
    nats: float
    usual: float
    reason: ReasonCode | None


@dataclass(frozen=True, slots=True)
class ExplainedModel:
    """The model, evaluated.

    Attributes
    ----------
    contributions : tuple of Contribution
        In the order of the model.
    log_odds : float
        The sum of the terms, nats.
    probability : float
        By the model and the prior probability `options.on_map`, 0 to 1.
    """

    contributions: tuple[Contribution, ...]
    log_odds: float
    probability: float


@dataclass(frozen=True, slots=True)
class WeighedAlternative:
    """An alternative, as the verdict weighs it.

    Attributes
    ----------
    pose : RigidTransform
        In the map frame.
    gap : float
        Its evidence less that of the answer, nats.
    counted : float
        Its weight by the ratio of its score to the answer's, 0 to 1.
    weight : float
        Relative to the answer, whose weight is 1.
    """

    pose: RigidTransform
    gap: float
    counted: float
    weight: float


@dataclass(frozen=True, slots=True)
class ExplainedNull:
    """The score of the mirrored scan.

    Attributes
    ----------
    score : float
        Nats; 0 where it is below `searched_above` of the answer's.
    fraction : float
        Of the answer's score.
    symmetry : float
        Fraction of the map's view that the map also shows mirrored, 0 to 1.
    searched_above : float
        Fraction of the answer's score; a lower null score makes no difference, and was not searched.
    """

    score: float
    fraction: float
    symmetry: float


@dataclass(frozen=True, slots=True)
class VetoOutcome:
    """One veto of the table, and whether it applies to the answer."""

    name: str
    origin: Origin
    applies: bool
    reasons: tuple[ReasonCode, ...]


@dataclass(frozen=True, slots=True)
class VerdictExplanation:
    """The numbers behind the verdict on an answer.

    The answer is usable if ``cautious`` reaches its threshold and no veto applies. It is the probability by the model
    times the least of those among the alternatives. ``probability_of_pose`` is that by the model for a scan of the map
    times the mean of them.

    Attributes
    ----------
    status : Status
    usable : bool
    probability : float or None
        As answered.
    pose : RigidTransform or None
    reasons : tuple of Reason
    vetoes : tuple of VetoOutcome
        The whole table, in its order.
    features : mapping or None
        By name; None without an answer, as all that follows.
    model : ExplainedModel or None
    taken : mapping or None
        By reason the decrease of the log odds by its features, nats.
    alternatives : tuple of WeighedAlternative
    among : AmongAlternatives or None
        Probability of the answer among its alternatives, by three comparisons.
    null : ExplainedNull or None
        None where it was not needed.
    probability_of_pose, cautious : float or None
    explained : float or None
        Probability that this place or a similar one is right.
    thresholds : mapping of str to float
        Of ``cautious`` and ``explained``.
    """

    status: Status
    usable: bool
    probability: float | None
    pose: RigidTransform | None
    reasons: tuple[Reason, ...]
    vetoes: tuple[VetoOutcome, ...]
    features: Mapping[str, float] | None = None
    model: ExplainedModel | None = None
    taken: Mapping[ReasonCode, float] | None = None
    alternatives: tuple[WeighedAlternative, ...] = ()
    among: AmongAlternatives | None = None
    null: ExplainedNull | None = None
    probability_of_pose: float | None = None
    explained: float | None = None
    thresholds: Mapping[str, float] | None = None


@dataclass(frozen=True, slots=True)
class AnswerExplanation:
    """An answer, and how its verdict came about.

    Attributes
    ----------
    result : AssociationResult
        The answer, as `associate` returns it.
    verdict : VerdictExplanation
        On the scan as a whole.
    """

    result: AssociationResult
    verdict: VerdictExplanation


def explain_verdict(
    index: MapIndex,
    scan: Scan,
    prior: Prior | None = None,
    options: AssociationOptions = DEFAULT_OPTIONS,
    deadline: Deadline | None = None,
) -> AnswerExplanation:
    """Answer as `associate`, and return how the verdict came about, number by number.

    Parameters
    ----------
    index : MapIndex
    scan : Scan
        In the sensor's frame.
    prior : SoftPrior, HardPrior or None
        In the map frame.
    options : AssociationOptions
    deadline : Deadline or None

    Returns
    -------
    AnswerExplanation

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    stages = run_stages(SearchContext.of(index, scan, prior, options, deadline or Deadline()))
    verdict = stages.verdict if stages.result.search.complete else stages.verdict.cut_short()
    return AnswerExplanation(stages.result, explained(stages.found.context, verdict))


def explained(context: SearchContext, verdict: Verdict) -> VerdictExplanation:
    """Return how a verdict came about."""
    names = {veto.name for veto in verdict.vetoes}
    vetoes = tuple(VetoOutcome(one.name, one.origin, one.name in names, one.reasons) for one in VETOES)
    shown = VerdictExplanation(
        verdict.status, verdict.usable, verdict.probability, verdict.pose, verdict.reasons, vetoes
    )
    found, description = verdict.probabilities, verdict.description
    return shown if found is None or description is None else _with_numbers(context, shown, description, found)


def _with_numbers(
    context: SearchContext, shown: VerdictExplanation, description: Description, found: Probabilities
) -> VerdictExplanation:
    return VerdictExplanation(
        shown.status,
        shown.usable,
        shown.probability,
        shown.pose,
        shown.reasons,
        shown.vetoes,
        features=found.features._asdict(),
        model=_evaluated(found),
        taken=taken_by_reason(found.features, found.model),
        alternatives=_weighed(context, description),
        among=found.among,
        null=_null(description, found),
        probability_of_pose=found.right,
        explained=found.explained,
        thresholds={"usable_from": context.options.usable_from, "explained": NO_MATCH_PROBABILITY},
    )


def _evaluated(found: Probabilities) -> ExplainedModel:
    model, values = found.model, found.features._asdict()
    terms, usual = model.terms(found.features), model.terms(USUAL)
    contributions = tuple(
        Contribution(name, values.get(name), nats, usual[name], ROLES[name].reason if name in ROLES else None)
        for name, nats in terms.items()
    )
    return ExplainedModel(contributions, sum(terms.values()), found.by_model)


def _weighed(context: SearchContext, description: Description) -> tuple[WeighedAlternative, ...]:
    """Return the alternatives with their weights, as in `probability_among`."""
    gaps, counted = description.alternatives["gap"], description.alternatives["counted"]
    weights = counted * np.exp(np.minimum(0.0, gaps))
    rows = zip(description.others, gaps.tolist(), counted.tolist(), weights.tolist(), strict=True)
    return tuple(WeighedAlternative(context.in_map(one.pose), *numbers) for one, *numbers in rows)


def _null(description: Description, found: Probabilities) -> ExplainedNull | None:
    if found.null is None:
        return None
    score = found.null.score
    return ExplainedNull(score, score / description.answer.best.score, found.null.symmetry)
