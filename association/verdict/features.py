"""What the verdict's probabilities depend on, by name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from registration.layout import Records

from ..consensus.ranking import Ranked
from ..context import SearchContext
from ..explanations import Answer
from ..layout import FACTS, FEATURES, MERIT, RIVAL, WEIGHED, record
from ..tuning import LONGEST_UNMATCHED
from .kernels import features as kernels
from .kernels import odds
from .null import Null


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


_describe = kernels.describe
_weigh = kernels.weigh
_see_hinges = kernels.see_hinges
_see_unmatched = kernels.see_unmatched
_is_thin = kernels.is_thin
_take_null = odds.take_null
twin_share = kernels.twin_share


def facts_of(context: SearchContext, answer: Answer) -> Records:
    """Return what is known of an answer besides its merits, (1,) of `FACTS`."""
    facts = record(
        FACTS,
        weakest=answer.settled.weakest,
        agreement=answer.agreement,
        farther=answer.beams.farther,
        nearer=answer.beams.nearer,
        significance=answer.significance,
    )
    _see_hinges(answer.settled.hinges, facts)
    views = context.scan.views
    if views is None or not views.uncertain:
        _see_unmatched(context.lines.rows, answer.best.matches, facts)
        return facts
    # The models know scans from one place: each view of a drive adds to what no map shows as it adds to what is
    # matched.
    seen = context.lines.sightings
    seen = seen[~answer.best.matched[seen["row"]]]
    longest, sums = np.zeros((2, len(views)))
    np.maximum.at(longest, seen["sensor"], np.minimum(seen["length"], LONGEST_UNMATCHED))
    np.add.at(sums, seen["sensor"], seen["length"])
    share = views.weights / views.weights.sum()
    facts["longest"], facts["unmatched"] = longest @ share, sums @ share
    return facts


def is_thin(context: SearchContext, answer: Answer, facts: Records) -> bool:
    """Tell whether so few walls fix the pose that one alone decides; `facts` (1,) are those of the answer."""
    return bool(_is_thin(facts, answer.best.matches, context.with_beams))


def describe(best: Ranked, facts: Records, weighed: Records) -> Records:
    """Return the features of an answer beside its rivals, with the least null there is, (1,) of `FEATURES`.

    `facts` (1,) of `FACTS`, `weighed` (k,) of `WEIGHED`.
    """
    features, merits = np.zeros(1, FEATURES), np.array([best.merit], MERIT)
    _describe(merits, best.value, facts, weighed, features)
    return features


def features_of(context: SearchContext, answer: Answer, weighed: Records) -> Features:
    """Return the same by name."""
    return Features(*describe(answer.best, facts_of(context, answer), weighed).item())


def with_null(features: Features, best: Ranked, null: Null) -> Features:
    """Return the features with what the mirrored scan comes to."""
    described = np.array([features], FEATURES)
    take_null(described, best, null)
    return Features(*described.item())


def take_null(features: Records, best: Ranked, null: Null) -> None:
    """Write what the mirrored scan comes to into the features, (1,) of `FEATURES`."""
    _take_null(best.score, null.score, null.symmetry, features)


def weigh(best: Ranked, rivals: Sequence[Ranked]) -> Records:
    """Weigh the rivals of the best explanation, (k,) of `WEIGHED`."""
    explanations = np.array([(one.value, one.cost, one.count) for one in (best, *rivals)], RIVAL)
    weighed = np.zeros(len(rivals), WEIGHED)
    _weigh(explanations, weighed)
    return weighed
