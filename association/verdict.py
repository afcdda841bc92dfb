"""From the ranked explanations to one verdict, and the chance that the first one is right."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration import RegistrationResult

from .ranking import Ranked
from .result import Status

Floats = NDArray[np.float64]

# Chance that the first explanation or a twin of it is right: a logistic model of `features`. The coefficients are those
# that `python -m benchmarks.calibration` fits.
COEFFICIENTS = (-6.30, 0.182, -0.199, 11.34, 0.586, -0.871, -4.03)
MAX_LEAD = 40.0  # nats
CROWD_TEMPERATURE = 4.0  # nats
LEAST_CROWD = -12.0
TWIN_TEMPERATURE = 1.5  # nats; how far apart two explanations score that are as likely as one to e

USABLE_PROBABILITY = 0.93
CHANCE = 1e-2  # significance beyond which chance explains a scan as well
CHANCE_SHARE = 0.5  # of the scan's length that then must be matched for an answer
CONTRADICTION = 6.0  # nats by which a pose that the prior speaks against must be better to contradict it
FAR = -9.0  # nats; a pose of which a soft prior says less lies outside it, at 4.2 standard deviations
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
    better_elsewhere = any(r.score > best.score + CONTRADICTION for r in ranked if r is not best)
    contradicted = better_elsewhere or best.value - best.score < FAR
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


def features(best: Ranked, others: list[Ranked]) -> Floats:
    """Return what the probability depends on.

    Returns
    -------
    (7,)
        1; lead over the best other explanation, nats; minus the log of the others' tempered evidence; matched share of
        the scan's length; square root of the number of matched segments; square root of their length, sqrt(m); standard
        deviation of the position along its weakest direction, up to 1 m.
    """
    lead = best.value - others[0].value if others else best.value
    crowd = math.log(_evidence(best, others, CROWD_TEMPERATURE) + math.exp(LEAST_CROWD))
    count = int((best.matches[:, 0] >= 0.0).sum())
    deviation = math.sqrt(float(np.linalg.eigvalsh(best.covariance[:2, :2])[1]))
    return np.array(
        [1.0, min(lead, MAX_LEAD), -crowd, best.share, math.sqrt(count), math.sqrt(best.length), min(deviation, 1.0)]
    )


def twin_share(best: Ranked, others: list[Ranked]) -> float:
    """Return the chance of the best explanation among those that are about as good, above 0 and up to 1."""
    return 1.0 / (1.0 + _evidence(best, others, TWIN_TEMPERATURE))


def right_probability(best: Ranked, others: list[Ranked]) -> float:
    """Return the calibrated chance that the best explanation is right, 0 to 1."""
    logit = float(features(best, others) @ np.array(COEFFICIENTS))
    return twin_share(best, others) / (1.0 + math.exp(-logit))


def _evidence(best: Ranked, others: list[Ranked], temperature: float) -> float:
    return sum(math.exp(min(0.0, other.value - best.value) / temperature) for other in others)


def is_degenerate(registered: RegistrationResult) -> bool:
    """Tell whether a direction of the position is not fixed: parallel pairs, or a deviation beyond 0.5 m."""
    if registered.degenerate or registered.covariance is None:
        return registered.degenerate
    return bool(np.linalg.eigvalsh(registered.covariance[:2, :2])[1] > MAX_DEVIATION**2)
