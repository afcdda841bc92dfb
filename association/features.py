"""What the verdict's probabilities depend on, by name."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from .context import SearchContext
from .explain import Answer
from .kernels.odds import left_unmatched, most_by_one_wall, null_features, root_gap
from .null import Null
from .ranking import Ranked
from .tuning import (
    CROWD_TEMPERATURE,
    LEAST_CHANCE_FEATURE,
    LEAST_CROWD,
    LEAST_MISFIT,
    LONGEST_UNMATCHED,
    MANY,
    MAX_LEAD,
    MOST_DEVIATION,
    MOST_MISFIT,
    MOST_UNMATCHED,
    NEARLY_ALL,
    NULL_SHARE,
    RIVAL_SHARE,
    TWIN_TEMPERATURE,
    UNCOUNTED_SHARE,
    USUAL_WALLS,
)


class Features(NamedTuple):
    """Numbers of one answer.

    Attributes
    ----------
    constant : 1
    lead : over the best other explanation, nats
    solitude : minus the log of the others' tempered evidence, of what may have been missed the less
    share : of the scan's length that is matched
    root_count : square root of the number of matched segments
    root_length : square root of their length, sqrt(m)
    deviation : standard deviation of the position along its weakest direction, m, up to `MOST_DEVIATION`
    misfit : log of the mean squared offset over what the sigmas expect
    inverse_count : one over the number of matched segments
    longest_unmatched : length of the longest segment that is not matched, m, up to `LONGEST_UNMATCHED`; of a drive
        the mean over its views
    agreement : share of directions in which the scan shows what the map does
    read, passed : shares of the beams that read the wall they should, and that passed through one; 0 without beams
    root_farther, root_nearer : roots of the shares of the beams that read farther, and nearer, than the map shows
    hinge_moves : by how much the position would move at most without one of its walls, m, up to `MOST_DEVIATION`
    hinge_deviation : its deviation along the weakest direction then, m, up to `MOST_DEVIATION`
    chance : log10 of the significance, from `LEAST_CHANCE_FEATURE`
    null : score of the mirrored scan over the answer's, from `NULL_SHARE` to `MOST_NULL`; as good as none where the map
        is symmetric about the place
    null_gap : root of what the answer's score has over the mirrored scan's, in nats, up to that of `MAX_GAP`; likewise
    null_better : by how much the mirrored scan's share of the score is over 1, symmetric or not, up to `MOST_NULL`
    root_score : root of the score by segments, nats
    blocked : root of what lines of sight speak against the answer, nats
    walls : root of the number of walls that hold a match
    misfit_of_many : misfit times the number of matched segments over `MANY`
    beyond_nearly_all : share of the length beyond `NEARLY_ALL`
    root_unmatched : square root of the length that is not matched, sqrt(m), up to that of `MOST_UNMATCHED`; of a drive
        that of the mean over its views
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
    read: float
    passed: float
    root_farther: float
    root_nearer: float
    hinge_moves: float
    hinge_deviation: float
    chance: float
    null: float
    null_gap: float
    null_better: float
    root_score: float
    blocked: float
    walls: float
    misfit_of_many: float
    beyond_nearly_all: float
    root_unmatched: float
    squared_solitude: float


NULL_PLACE = Features._fields.index("null")  # where these three begin
DEVIATION_PLACE = Features._fields.index("deviation")


def features_of(context: SearchContext, answer: Answer, weighed: Sequence[Weighed]) -> Features:
    """Return the features of an answer beside its rivals, with the least null there is."""
    best, hinges = answer.best, answer.settled.hinges
    lead = -max(gap for gap, _ in weighed) if weighed else best.value
    crowd = math.log(_evidence(weighed, CROWD_TEMPERATURE) + math.exp(LEAST_CROWD))
    count = best.count
    longest, unmatched = _unmatched(context, best)
    moves, hinge_deviation = most_by_one_wall(hinges)
    misfit = math.log(min(MOST_MISFIT, max(LEAST_MISFIT, best.misfit)))
    return Features(
        constant=1.0,
        lead=min(lead, MAX_LEAD),
        solitude=-crowd,
        share=best.share,
        root_count=math.sqrt(count),
        root_length=math.sqrt(best.length),
        deviation=min(answer.settled.weakest, MOST_DEVIATION),
        misfit=misfit,
        inverse_count=1.0 / max(1, count),
        longest_unmatched=longest,
        agreement=answer.agreement,
        read=best.read,
        passed=best.passed,
        root_farther=math.sqrt(answer.beams.farther),
        root_nearer=math.sqrt(answer.beams.nearer),
        hinge_moves=min(moves, MOST_DEVIATION),
        hinge_deviation=min(hinge_deviation, MOST_DEVIATION),
        chance=max(LEAST_CHANCE_FEATURE, math.log10(answer.significance)),
        null=NULL_SHARE,
        null_gap=root_gap((1.0 - NULL_SHARE) * best.score),
        null_better=0.0,
        root_score=math.sqrt(max(0.0, best.by_segments)),
        blocked=math.sqrt(best.blocked),
        walls=math.sqrt(len(hinges)),
        misfit_of_many=misfit * min(count, MANY) / MANY,
        beyond_nearly_all=max(0.0, best.share - NEARLY_ALL),
        root_unmatched=math.sqrt(min(unmatched, MOST_UNMATCHED)),
        squared_solitude=crowd**2,
    )


def _unmatched(context: SearchContext, best: Ranked) -> tuple[float, float]:
    """Return the length of the longest segment that is not matched, and of all of them, metres; of a drive by view.

    The models know scans from one place: each view of a drive adds to what no map shows as it adds to what is matched.
    """
    views = context.scan.views
    if views is None or not views.uncertain:
        most, together = left_unmatched(context.lines.rows, best.matches)
        return min(most, LONGEST_UNMATCHED), together
    seen = context.lines.sightings
    seen = seen[~best.matched[seen["row"]]]
    longest, sums = np.zeros((2, len(views)))
    np.maximum.at(longest, seen["sensor"], np.minimum(seen["length"], LONGEST_UNMATCHED))
    np.add.at(sums, seen["sensor"], seen["length"])
    return float(longest.mean()), float(sums.mean())


def with_null(features: Features, best: Ranked, null: Null) -> Features:
    """Return the features with what the mirrored scan comes to."""
    null_share, gap, better = null_features(best.score, null.score, null.symmetry)
    return features._replace(null=null_share, null_gap=gap, null_better=better)


class Weighed(NamedTuple):
    """A rival beside the best explanation.

    Attributes
    ----------
    gap : by how much it is worth more, nats, with the walls as far off as they may be
    counted : how far it counts, 0 to 1: fully where the search cannot have missed one as good
    """

    gap: float
    counted: float


def weigh(best: Ranked, rivals: Sequence[Ranked]) -> list[Weighed]:
    """Weigh the rivals of the best explanation."""
    least, value = worth(best), best.value
    shares = [rival.value / value if value > 0.0 else 1.0 for rival in rivals]
    counted = [min(1.0, max(0.0, (share - UNCOUNTED_SHARE) / (RIVAL_SHARE - UNCOUNTED_SHARE))) for share in shares]
    return [Weighed(worth(rival) - least, part) for rival, part in zip(rivals, counted, strict=True)]


def worth(one: Ranked) -> float:
    """Return the value of an explanation, nats, where nobody knows how far the walls are off.

    The value takes half the cost, the likelihood of its residuals where walls are off by `MODEL_OFFSET`. Of n matches
    with an unknown variance, which `USUAL_WALLS` (k) before are taken to have shown to be as much, the likelihood is
    Student's t: ``log G((n + k) / 2) - log G(k / 2) - n / 2 log(k / 2) - (n + k) / 2 log(1 + cost / k)``. Where the
    walls of a map are off by more, the centimetres that tell rivals apart count that much less.
    """
    n, k = one.count, USUAL_WALLS
    student = _student_constant(n) - 0.5 * (n + k) * math.log1p(one.cost / k)
    return one.value + 0.5 * one.cost + student


@lru_cache
def _student_constant(n: int) -> float:
    k = USUAL_WALLS
    return math.lgamma(0.5 * (n + k)) - math.lgamma(0.5 * k) - 0.5 * n * math.log(0.5 * k)


def twin_share(weighed: Sequence[Weighed]) -> float:
    """Return the chance of the best explanation among its rivals that are about as good, above 0 and up to 1."""
    return 1.0 / (1.0 + _evidence(weighed, TWIN_TEMPERATURE))


def _evidence(weighed: Sequence[Weighed], temperature: float) -> float:
    return sum(counted * math.exp(min(0.0, gap) / temperature) for gap, counted in weighed)
