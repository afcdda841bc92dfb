"""What the verdict's probabilities depend on, by name."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from .context import SearchContext
from .explain import Answer
from .ranking import Ranked
from .tuning import (
    CROWD_TEMPERATURE,
    LEAST_CROWD,
    LEAST_MISFIT,
    LONGEST_UNMATCHED,
    MANY,
    MAX_LEAD,
    MOST_DEVIATION,
    MOST_MISFIT,
    MOST_UNMATCHED,
    NEARLY_ALL,
    TWIN_TEMPERATURE,
)


class Features(NamedTuple):
    """Numbers of one answer.

    Attributes
    ----------
    constant : 1
    lead : over the best other explanation, nats
    solitude : minus the log of the others' tempered evidence
    share : of the scan's length that is matched
    root_count : square root of the number of matched segments
    root_length : square root of their length, sqrt(m)
    deviation : standard deviation of the position along its weakest direction, m, up to `MOST_DEVIATION`
    misfit : log of the mean squared offset over what the sigmas expect
    inverse_count : one over the number of matched segments
    longest_unmatched : length of the longest segment that is not matched, m, up to `LONGEST_UNMATCHED`
    agreement : share of directions in which the scan shows what the map does
    misfit_of_many : misfit times the number of matched segments over `MANY`
    beyond_nearly_all : share of the length beyond `NEARLY_ALL`
    root_unmatched : square root of the length that is not matched, sqrt(m), up to that of `MOST_UNMATCHED`
    squared_solitude : square of `solitude`
    """

    constant: float
    lead: float
    solitude: float
    share: float
    root_count: float
    root_length: float
    deviation: float
    misfit: float
    inverse_count: float
    longest_unmatched: float
    agreement: float
    misfit_of_many: float
    beyond_nearly_all: float
    root_unmatched: float
    squared_solitude: float


def features_of(context: SearchContext, answer: Answer, rivals: Sequence[Ranked]) -> Features:
    """Return the features of an answer beside its rivals, best first."""
    best = answer.best
    lead = best.value - rivals[0].value if rivals else best.value
    crowd = math.log(_evidence(best, rivals, CROWD_TEMPERATURE) + math.exp(LEAST_CROWD))
    count = int(best.matched.sum())
    unmatched = context.segments.rows["length"][~best.matched]
    misfit = math.log(min(MOST_MISFIT, max(LEAST_MISFIT, best.misfit)))
    return Features(
        constant=1.0,
        lead=min(lead, MAX_LEAD),
        solitude=-crowd,
        share=best.share,
        root_count=math.sqrt(count),
        root_length=math.sqrt(best.length),
        deviation=min(best.deviation, MOST_DEVIATION),
        misfit=misfit,
        inverse_count=1.0 / max(1, count),
        longest_unmatched=min(float(unmatched.max(initial=0.0)), LONGEST_UNMATCHED),
        agreement=answer.agreement,
        misfit_of_many=misfit * min(count, MANY) / MANY,
        beyond_nearly_all=max(0.0, best.share - NEARLY_ALL),
        root_unmatched=math.sqrt(min(float(unmatched.sum()), MOST_UNMATCHED)),
        squared_solitude=crowd**2,
    )


def twin_share(best: Ranked, rivals: Sequence[Ranked]) -> float:
    """Return the chance of the best explanation among those that are about as good, above 0 and up to 1."""
    return 1.0 / (1.0 + _evidence(best, rivals, TWIN_TEMPERATURE))


def _evidence(best: Ranked, rivals: Sequence[Ranked], temperature: float) -> float:
    return sum(math.exp(min(0.0, other.value - best.value) / temperature) for other in rivals)
