"""Compare the best explanation with its alternatives; see `association.verdict.alternatives`."""

import math

from compiled import kernel
from registration.layout import Record, Records

from ...consensus.tuning import USUAL_WALLS
from ...tuning import RIVAL_SHARE
from ..tuning import UNCOUNTED_FRACTION
from .odds import fraction_between


@kernel
def log_evidence(one: Record) -> float:
    """Return the evidence of an explanation, a record of `COMPARED`, if the walls' error is unknown, nats.

    The score takes half the chi-square, the likelihood of its residuals where walls are off by `MODEL_OFFSET`. Of n
    matches with an unknown variance, which `USUAL_WALLS` (k) before are taken to have shown to be as much, the
    likelihood is Student's t:
    ``log G((n + k) / 2) - log G(k / 2) - n / 2 log(k / 2) - (n + k) / 2 log(1 + chi_square / k)``.
    If the walls of a map are off by more, the centimetres between alternatives count that much less.
    """
    n = one.count
    k = USUAL_WALLS
    student = math.lgamma(0.5 * (n + k)) - math.lgamma(0.5 * k) - 0.5 * n * math.log(0.5 * k)
    student -= 0.5 * (n + k) * math.log1p(one.chi_square / k)
    return one.posterior + 0.5 * one.chi_square + student


@kernel
def compare(explanations: Records, alternatives: Records) -> None:
    """Compare the first of some explanations, (k + 1,) of `COMPARED`, with the others.

    Writes (k,) of `ALTERNATIVE`.
    """
    best = explanations[0]
    least = log_evidence(best)
    for k in range(len(alternatives)):
        other = explanations[k + 1]
        ratio = other.posterior / best.posterior if best.posterior > 0.0 else 1.0
        alternatives[k].gap = log_evidence(other) - least
        alternatives[k].counted = fraction_between(ratio, UNCOUNTED_FRACTION, RIVAL_SHARE)


@kernel
def tempered_evidence(alternatives: Records, temperature: float) -> float:
    """Return the evidence of the alternatives over that of the best, each at most 1, at a temperature, nats."""
    total = 0.0
    for k in range(len(alternatives)):
        total += alternatives[k].counted * math.exp(min(0.0, alternatives[k].gap) / temperature)
    return total


@kernel
def probability_among(alternatives: Records) -> float:
    """Return the probability of the best explanation among those that are about as good, above 0 and up to 1."""
    return 1.0 / (1.0 + tempered_evidence(alternatives, 1.0))
