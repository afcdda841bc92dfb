"""Explain a verdict number by number: features, contributions, alternatives, null score, vetoes, thresholds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from registration import RigidTransform

from .associating import DEFAULT_OPTIONS, run_stages
from .context import SearchContext
from .deadline import Deadline
from .index.map_index import MapIndex
from .options import AssociationOptions, Prior
from .result import AssociationResult, Reason, ReasonCode, Status
from .scan.scan import Scan
from .verdict.features import ROLES
from .verdict.model import ELSEWHERE, USUAL, WRONG
from .verdict.reasons import VETOES, taken_by_reason
from .verdict.tuning import NO_MATCH_PROBABILITY
from .verdict.verdict import Verdict


@dataclass(frozen=True, slots=True)
class Contribution:
    """The term of one feature in the logarithm of the odds against one way of being not right.

    Attributes
    ----------
    name : str
        Of the feature.
    against : "wrong" or "elsewhere"
        Another pose of this map, or a scan that was taken elsewhere.
    value : float
        Of the feature.
    nats, usual : float
        The term, and that of a usual right answer.
    reason : str
        The reason that the feature gives where its term is lower than usual.
    """

    name: str
    against: str
    value: float
    nats: float
    usual: float
    reason: ReasonCode


@dataclass(frozen=True, slots=True)
class WeighedAlternative:
    """An alternative, as the verdict weighs it.

    Attributes
    ----------
    pose : RigidTransform
        In the map frame.
    gap : float
        Nats of evidence by which the answer is better, thing by thing.
    counted : float
        Degree to which it counts, 0 to 1.
    weight : float
        Its probability over that of the answer.
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
        Nats; 0 where none was found.
    fraction : float
        Of the answer's score.
    """

    score: float
    fraction: float


@dataclass(frozen=True, slots=True)
class VetoOutcome:
    """One veto of the table, whether it applies to the answer, and the reason that it gives."""

    name: str
    applies: bool
    reason: ReasonCode


@dataclass(frozen=True, slots=True)
class VerdictExplanation:
    """The numbers behind the verdict on an answer.

    The answer is usable if no veto applies and ``probability`` reaches ``usable_from``. It is the probability by the
    model times that among the alternatives. The model has two logarithms of odds, a constant and the contributions of
    the features each: against another pose of this map, and against another place. The latter is weighed by the prior
    probability ``on_map``. All further numbers are None without an answer.

    Attributes
    ----------
    status, usable, probability, pose, reasons
        As in the answer.
    vetoes : tuple of VetoOutcome
    features : mapping of str to float, or None
    contributions : tuple of Contribution
    log_odds : mapping, or None
        Of ``wrong`` and ``elsewhere``, nats.
    taken : mapping of reason to float, or None
        By how much the log odds rise if the features of a reason are usual, nats.
    by_model, among, explained : float or None
        Probability by the model; among the alternatives; that the scan explains this place or a similar one.
    alternatives : tuple of WeighedAlternative
    null : ExplainedNull or None
        None where the mirrored scan was not searched.
    thresholds : mapping of str to float
    """

    status: Status
    usable: bool
    probability: float | None
    pose: RigidTransform | None
    reasons: tuple[Reason, ...]
    vetoes: tuple[VetoOutcome, ...]
    thresholds: Mapping[str, float]
    features: Mapping[str, float] | None = None
    contributions: tuple[Contribution, ...] = ()
    log_odds: Mapping[str, float] | None = None
    taken: Mapping[ReasonCode, float] | None = None
    by_model: float | None = None
    among: float | None = None
    explained: float | None = None
    alternatives: tuple[WeighedAlternative, ...] = ()
    null: ExplainedNull | None = None


@dataclass(frozen=True, slots=True)
class AnswerExplanation:
    """An answer, and how its verdict came about.

    Attributes
    ----------
    result : AssociationResult
        The answer, as `associate` returns it.
    verdict : VerdictExplanation
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
    return AnswerExplanation(stages.result, _explained(stages.context, verdict))


def _explained(context: SearchContext, verdict: Verdict) -> VerdictExplanation:
    applying = {veto.name for veto in verdict.vetoes}
    vetoes = tuple(VetoOutcome(one.name, one.name in applying, one.reason) for one in VETOES)
    options = context.options
    thresholds = {"usable_from": options.usable_from, "on_map": options.on_map, "explained": NO_MATCH_PROBABILITY}
    shown = (verdict.status, verdict.usable, verdict.probability, verdict.pose, verdict.reasons, vetoes, thresholds)
    described, model = verdict.described, verdict.model
    if described is None or model is None:
        return VerdictExplanation(*shown)
    features, comparison, null = described.features, described.comparison, described.null
    contributions = [
        Contribution(name, against, getattr(features, name), nats, odds.terms(USUAL)[name], ROLES[name].reason)
        for against, odds in ((WRONG, model.wrong), (ELSEWHERE, model.elsewhere))
        for name, nats in odds.terms(features).items()
    ]
    best = verdict.score or 1.0
    return VerdictExplanation(
        *shown,
        features=features._asdict(),
        contributions=tuple(contributions),
        log_odds={WRONG: model.wrong.at(features), ELSEWHERE: model.elsewhere.at(features)},
        taken=taken_by_reason(model, features, options.on_map),
        by_model=verdict.by_model,
        among=comparison.probability,
        explained=verdict.explained,
        alternatives=tuple(
            WeighedAlternative(context.in_map(one.pose), gap, counted, weight)
            for one, gap, counted, weight in zip(
                comparison.others,
                comparison.gaps.tolist(),
                comparison.counted.tolist(),
                comparison.weights.tolist(),
                strict=True,
            )
        ),
        null=ExplainedNull(null, null / best) if verdict.searched_null else None,
    )
