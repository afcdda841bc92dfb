"""From the ranked explanations to one verdict, and the chance that the first one is right."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from registration import RegistrationResult

from ._sight_kernels import BLOCKED
from .ranking import Ranked
from .result import Status

# Logistic model of the chance that the first pose is right, from the calibration command in benchmarks/.
INTERCEPT = -1.6
PER_LEAD = 0.35  # nats of lead over the best other pose, up to MAX_LEAD
PER_CROWD = 0.15  # log of the other poses' share in the evidence, tempered
PER_SHARE = 2.4  # matched share of the scan's length
PER_ROOT_COUNT = 0.4  # square root of the number of matched segments
MAX_LEAD = 60.0
TEMPERATURE = 4.0
LEAST_CROWD = -12.0

USABLE_PROBABILITY = 0.95
CHANCE = 1e-2  # significance beyond which chance explains a scan as well
CHANCE_SHARE = 0.5  # of the scan's length that then must be matched for an answer
CONTRADICTION = 3.0 * BLOCKED  # nats by which a pose that the prior speaks against must be better to contradict it
MAX_DEVIATION = 0.5  # m; beyond it the weakest direction counts as not fixed


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the evidence comes to."""

    status: Status
    probability: float
    margin: float | None
    runner_up: float | None
    contradicted: bool


def judge(ranked: list[Ranked], chance: float, registered: RegistrationResult | None) -> Verdict:
    """Weigh the best explanation against the others and against chance.

    Parameters
    ----------
    ranked : list of Ranked
        As ordered by `rank_candidates`; may be empty.
    chance : float
        Significance of the best one, 0 to 1.
    registered : RegistrationResult or None
        Of the best one's pairs.
    """
    inside = [r for r in ranked if r.inside]
    if not inside or registered is None:
        return Verdict(Status.NO_MATCH, 0.0, None, None, bool(ranked))
    best = inside[0]
    contradicted = any(r.score > best.score + CONTRADICTION for r in ranked if r is not best)
    others = inside[1:]
    lead = best.value - others[0].value if others else best.value
    probability = right_probability(best, others)
    if contradicted:
        probability = min(probability, 0.5)
    margin = lead if others else None
    runner_up = max(0.0, others[0].value / best.value) if others and best.value > 0.0 else None
    if chance > CHANCE and best.share < CHANCE_SHARE:
        status = Status.NO_MATCH
    elif is_degenerate(registered):
        status = Status.DEGENERATE
    elif probability < USABLE_PROBABILITY:
        status = Status.AMBIGUOUS
    else:
        status = Status.OK
    return Verdict(status, probability, margin, runner_up, contradicted)


def right_probability(best: Ranked, others: list[Ranked]) -> float:
    """Return the calibrated chance that the best explanation is right, 0 to 1."""
    lead = min(MAX_LEAD, best.value - others[0].value if others else best.value)
    crowd = sum(math.exp((other.value - best.value) / TEMPERATURE) for other in others)
    crowd = max(LEAST_CROWD, math.log(crowd)) if crowd > 0.0 else LEAST_CROWD
    count = int((best.matches[:, 0] >= 0.0).sum())
    logit = INTERCEPT + PER_LEAD * lead - PER_CROWD * crowd + PER_SHARE * best.share + PER_ROOT_COUNT * math.sqrt(count)
    return 1.0 / (1.0 + math.exp(-logit))


def is_degenerate(registered: RegistrationResult) -> bool:
    """Tell whether a direction of the position is not fixed: parallel pairs, or a deviation beyond 0.5 m."""
    if registered.degenerate or registered.covariance is None:
        return registered.degenerate
    return bool(np.linalg.eigvalsh(registered.covariance[:2, :2])[1] > MAX_DEVIATION**2)
