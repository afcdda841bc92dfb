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

# Chance that the first explanation or a twin of it is right: logistic models of `features`, by maximum likelihood over
# floor plans and logs; `python -m benchmarks.calibration` fits them, and reports them cross-validated over buildings.
# The first for scans that are known to be of this map. The second also over scans of other buildings, at three tenths
# of the weight: what it says decides about going by an answer.
COEFFICIENTS = (
    -1.355, 0.1677, -0.122, 1.926, 0.5116, 0.003968, -5.767, 0.3141, -2.644, -0.5231, 4.393, -0.7998,
    -9.091, -0.124, -0.007346,
)  # fmt: skip
CAUTIOUS = (
    3.493, 0.1901, 0.12, -0.6127, -0.1404, 0.5051, -5.541, 0.4722, -3.307, -0.5378, 3.68, -1.264,
    -21.53, -2.179, -0.0269,
)  # fmt: skip
# With raw beams, which tell a wrong place by themselves, one model of the first eight features does for both.
COEFFICIENTS_WITH_BEAMS = (-5.931, 0.090, 0.341, 4.763, 0.832, 0.095, -3.275, -0.018)
DEVIATION = 6  # place among the features
MANY = 8  # matched segments, from which on the misfit says as much as it can
NEARLY_ALL = 0.85  # of the scan's length
LONGEST_UNMATCHED = 4.0  # m; a longer segment
MOST_UNMATCHED = 16.0  # m; and more clutter say no more
MAX_LEAD = 40.0  # nats
CROWD_TEMPERATURE = 4.0  # nats
LEAST_CROWD = -12.0
LEAST_MISFIT, MOST_MISFIT = 1e-2, 1e3
TWIN_TEMPERATURE = 1.5  # nats; how far apart two explanations score that are as likely as one to e

USABLE_PROBABILITY = 0.94
USABLE_CAUTIOUS = 0.92  # of the same, where other buildings are reckoned with
USABLE_BY_CHANCE = 0.98  # likewise, where chance alone scores as high with that probability:
LIKELY_BY_CHANCE = 0.3
FEWEST = 3  # matched segments, or else
MOSTLY = 0.7  # of the scan's length
NO_MATCH_PROBABILITY = 0.03  # of the first explanation or a twin of it
CHANCE = 1e-3  # where chance scores as high more often, other buildings are reckoned with in that too
CONTRADICTION = 6.0  # nats by which a pose that the prior speaks against must be better to contradict it
FAR = -9.0  # nats; a pose of which a soft prior says less lies outside it, at 4.2 standard deviations
MAX_DEVIATION = 0.5  # m; beyond it the weakest direction counts as not fixed


@dataclass(frozen=True, slots=True)
class Evidence:
    """What is known beside the explanations.

    Attributes
    ----------
    lengths : (n,)
        Of the scan segments, metres, in the order of the matches.
    agreement : float
        Share of directions in which the scan shows what the map does, 0 to 1.
    significance : float
        Probability that chance scores as high.
    with_beams : bool
        Whether raw beams are in the scores.
    """

    lengths: Floats
    agreement: float
    significance: float
    with_beams: bool


@dataclass(frozen=True, slots=True)
class Verdict:
    """What the evidence comes to."""

    status: Status
    probability: float
    margin: float | None
    runner_up: float | None
    contradicted: bool


def judge(ranked: list[Ranked], registered: RegistrationResult | None, evidence: Evidence) -> Verdict:
    """Weigh the best explanation against the others and against none being right.

    Parameters
    ----------
    ranked : list of Ranked
        As ordered by `rank_candidates`; may be empty.
    registered : RegistrationResult or None
        Of the best one's pairs.
    evidence : Evidence
    """
    inside = [r for r in ranked if r.inside]
    if not inside or registered is None:
        return Verdict(Status.NO_MATCH, 0.0, None, None, bool(ranked))
    best = inside[0]
    better_elsewhere = any(r.score > best.score + CONTRADICTION for r in ranked if r is not best)
    contradicted = better_elsewhere or best.value - best.score < FAR
    others = inside[1:]
    x, share = features(best, others, evidence), twin_share(best, others)
    coefficients, cautious = np.array(COEFFICIENTS), np.array(CAUTIOUS)
    if evidence.with_beams:
        coefficients = cautious = np.array(COEFFICIENTS_WITH_BEAMS)
        x = x[: len(coefficients)]
    probability = _logistic(float(x @ coefficients)) * share
    careful = _logistic(float(x @ cautious)) * share
    # Whether anything explains the scan is another question than whether it fixes the position.
    x[DEVIATION] = 0.0
    explained = _logistic(float(x @ coefficients))
    if evidence.significance > CHANCE:
        explained = min(explained, _logistic(float(x @ cautious)))
    if better_elsewhere:
        probability = min(probability, 0.5)
    margin = best.value - others[0].value if others else None
    runner_up = max(0.0, others[0].value / best.value) if others and best.value > 0.0 else None
    if explained < NO_MATCH_PROBABILITY:
        status = Status.NO_MATCH
    elif is_degenerate(registered):
        status = Status.DEGENERATE
    elif probability < USABLE_PROBABILITY or careful < _bar(evidence) or _is_thin(best):
        status = Status.AMBIGUOUS
    else:
        status = Status.OK
    return Verdict(status, min(probability, 0.5) if contradicted else probability, margin, runner_up, contradicted)


def _bar(evidence: Evidence) -> float:
    """Return what the cautious probability has to reach."""
    if evidence.significance > LIKELY_BY_CHANCE:
        return USABLE_BY_CHANCE
    return USABLE_PROBABILITY if evidence.with_beams else USABLE_CAUTIOUS


def _is_thin(best: Ranked) -> bool:
    """Tell whether a corner is all that fits, and most of the scan does not: any building has one."""
    return int((best.matches[:, 0] >= 0.0).sum()) < FEWEST and best.share < MOSTLY


def features(best: Ranked, others: list[Ranked], evidence: Evidence) -> Floats:
    """Return what the probability depends on.

    Returns
    -------
    (15,)
        1; lead over the best other explanation, nats; minus the log of the others' tempered evidence; matched share of
        the scan's length; square root of the number of matched segments; square root of their length, sqrt(m); standard
        deviation of the position along its weakest direction, up to 1 m; log of the misfit; one over that number; the
        longest segment that is not matched, up to 4 m; the agreement of what is seen with the map; the log of the
        misfit times the number over `MANY`; the share beyond `NEARLY_ALL`; square root of the length that is not
        matched, up to 4 sqrt(m); the square of the third.
    """
    lead = best.value - others[0].value if others else best.value
    crowd = math.log(_evidence(best, others, CROWD_TEMPERATURE) + math.exp(LEAST_CROWD))
    matched = best.matches[:, 0] >= 0.0
    count = int(matched.sum())
    unmatched = evidence.lengths[~matched]
    deviation = math.sqrt(float(np.linalg.eigvalsh(best.covariance[:2, :2])[1]))
    misfit = math.log(min(MOST_MISFIT, max(LEAST_MISFIT, best.misfit)))
    return np.array(
        [
            1.0,
            min(lead, MAX_LEAD),
            -crowd,
            best.share,
            math.sqrt(count),
            math.sqrt(best.length),
            min(deviation, 1.0),
            misfit,
            1.0 / max(1, count),
            min(float(unmatched.max(initial=0.0)), LONGEST_UNMATCHED),
            evidence.agreement,
            misfit * min(count, MANY) / MANY,
            max(0.0, best.share - NEARLY_ALL),
            math.sqrt(min(float(unmatched.sum()), MOST_UNMATCHED)),
            crowd**2,
        ]
    )


def twin_share(best: Ranked, others: list[Ranked]) -> float:
    """Return the chance of the best explanation among those that are about as good, above 0 and up to 1."""
    return 1.0 / (1.0 + _evidence(best, others, TWIN_TEMPERATURE))


def _logistic(logit: float) -> float:
    return 1.0 / (1.0 + math.exp(-logit))


def _evidence(best: Ranked, others: list[Ranked], temperature: float) -> float:
    return sum(math.exp(min(0.0, other.value - best.value) / temperature) for other in others)


def is_degenerate(registered: RegistrationResult) -> bool:
    """Tell whether a direction of the position is not fixed: parallel pairs, or a deviation beyond 0.5 m."""
    if registered.degenerate or registered.covariance is None:
        return registered.degenerate
    return bool(np.linalg.eigvalsh(registered.covariance[:2, :2])[1] > MAX_DEVIATION**2)
