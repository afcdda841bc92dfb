"""The features that the verdict's probabilities depend on.

A new feature is a field of `Features` with its meaning, its computation in `kernels.features.describe`, and its row in
`roles.ROLES`. Name it in the lists of ``benchmarks.calibration``, and fit the models again.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from registration.layout import Records
from registration.values import value

from ..consensus.consensus_set import ConsensusSet
from ..context import SearchContext
from ..explanations import Answer, Explanations
from ..layout import FACTS, SET_SCORE, record
from .alternatives import compare_alternatives
from .chance import NullScore
from .kernels import features as kernels
from .kernels.null_features import write_null_features
from .tuning import LIKE_WALLS, LONGEST_UNMATCHED


class Features(NamedTuple):
    """Numbers of one answer.

    Attributes
    ----------
    constant : 1
    lead : over the best other explanation, nats
    solitude : minus the log of the others' tempered evidence, of what may have been missed the less
    inlier_fraction : of the scan's length that is matched
    root_length : square root of the length of the matched segments, sqrt(m)
    deviation : standard deviation of the position along its weakest direction, m, up to `MOST_DEVIATION`
    misfit : log of the mean squared offset over what the scan's sigmas expect
    longest_unmatched : length of the longest segment that is not matched, m, up to `LONGEST_UNMATCHED`; of a drive
        the mean over its views
    agreement : fraction of directions in which the scan shows what the map does
    root_passed : root of the fraction that passed through a wall, short walls less, as in the score
    root_farther, root_nearer : roots of the fractions of the beams that read farther, and nearer, than the map shows
    root_passed_any : root of the fraction of the beams that passed through a wall, however short
    critical_displacement : how far the position would move at most without one of its walls, m, up to `MOST_DEVIATION`
    critical_deviation : its deviation along the weakest direction then, m, up to `MOST_DEVIATION`
    null : score of the mirrored scan over the answer's, from `NULL_FRACTION` to `MOST_NULL`; the least where the map
        is symmetric about the place
    null_gap : root of what the answer's score has over the mirrored scan's, in nats, up to that of `MAX_GAP`; likewise
    null_better : by how much the mirrored scan's score over the answer's is above 1, symmetric or not, at most
    blocked : root of the penalty of lines of sight, nats
    walls : root of the number of walls that hold a match
    misfit_of_many : misfit times the number of matched segments over `MANY`
    root_unmatched_walls : square root of the length of the segments that are not matched and are as long as walls, in
        part from the first of `LIKE_WALLS` on, sqrt(m), up to that of `MOST_UNMATCHED`; of a drive the mean over its
        views
    squared_solitude : square of `solitude`
    """

    constant: float
    lead: float
    solitude: float
    inlier_fraction: float
    root_length: float
    deviation: float
    misfit: float
    longest_unmatched: float
    agreement: float
    root_passed: float
    root_farther: float
    root_nearer: float
    root_passed_any: float
    critical_displacement: float
    critical_deviation: float
    null: float
    null_gap: float
    null_better: float
    blocked: float
    walls: float
    misfit_of_many: float
    root_unmatched_walls: float
    squared_solitude: float


FEATURES = np.dtype([(name, np.float64) for name in Features._fields])
"""The same as a record, for the kernels."""


@value(frozen=True, slots=True)
class Description:
    """An answer among its alternatives, before any probability.

    Attributes
    ----------
    answer : Answer
    others : tuple of ConsensusSet
        Its alternatives, best first.
    alternatives : (k,) of `ALTERNATIVE`
        The gap of each of them to the answer, and how far it counts.
    features : (1,) of `FEATURES`
        With the least null score there is.
    few_walls : bool
        True if few walls fix the pose, and one of them alone decides.
    """

    answer: Answer
    others: tuple[ConsensusSet, ...]
    alternatives: Records
    features: Records
    few_walls: bool


def describe_answer(context: SearchContext, explanations: Explanations, answer: Answer) -> Description:
    """Compare an answer with its alternatives, and describe it by features."""
    best, others = answer.best, tuple(explanations.alternatives)
    alternatives, facts = compare_alternatives(best, others), facts_of(context, answer)
    few_walls = depends_on_one_wall(context, answer, facts)
    features = describe(scores_of(context, best), best.posterior, facts, alternatives)
    return Description(answer, others, alternatives, features, few_walls)


def scores_of(context: SearchContext, best: ConsensusSet) -> Records:
    """Return the scores of the best explanation, (1,) of `SET_SCORE`.

    The models were fitted to scans from one place. Of a drive, the matched length is that of its mean view, and the
    lines of sight that are blocked are counted for each view: both grow with the way.
    """
    scores, views = np.array([best.scores], SET_SCORE), context.scan.views
    if views is not None and views.uncertain:
        seen = context.lines.sightings
        scores["length"] = _of_mean_view(context, seen[best.matched[seen["row"]]])
        scores["blocked"] /= len(views)
    return scores


def _of_mean_view(context: SearchContext, seen: Records) -> float:
    """Return the length of some sightings, (k,) of `SIGHTING`, in the mean view of a drive, metres."""
    views = context.scan.views
    assert views is not None
    return float(np.bincount(seen["sensor"], seen["length"], len(views)) @ views.weights / views.weights.sum())


def facts_of(context: SearchContext, answer: Answer) -> Records:
    """Return the facts of an answer in addition to its score, (1,) of `FACTS`."""
    facts = record(
        FACTS,
        weakest=answer.estimated.weakest,
        agreement=answer.agreement,
        farther=answer.beams.farther,
        nearer=answer.beams.nearer,
        passed=answer.beams.passed,
    )
    kernels.measure_leverages(answer.estimated.leverages, facts)
    views = context.scan.views
    if views is None or not views.uncertain:
        kernels.measure_unmatched(context.lines.rows, answer.best.matches, facts)
        return facts
    # The models were fitted to scans from one place: each view of a drive adds to what no map shows as it adds to
    # what is matched.
    seen = context.lines.sightings
    seen = seen[~answer.best.matched[seen["row"]]]
    longest = np.zeros(len(views))
    np.maximum.at(longest, seen["sensor"], np.minimum(seen["length"], LONGEST_UNMATCHED))
    facts["longest"] = longest @ views.weights / views.weights.sum()
    seen["length"] *= np.interp(seen["length"], LIKE_WALLS, (0.0, 1.0))
    facts["unmatched_walls"] = _of_mean_view(context, seen)
    return facts


def depends_on_one_wall(context: SearchContext, answer: Answer, facts: Records) -> bool:
    """Return whether so few walls fix the pose that one alone decides; `facts` (1,) are those of the answer."""
    return bool(kernels.depends_on_one_wall(facts, answer.best.matches, context.with_beams))


def describe(scores: Records, posterior: float, facts: Records, alternatives: Records) -> Records:
    """Return the features of an answer among its alternatives, with the least null score there is, (1,) of `FEATURES`.

    `scores` (1,) of `SET_SCORE`, its `posterior` in nats, `facts` (1,) of `FACTS`, `alternatives` (k,) of
    `ALTERNATIVE`.
    """
    features = np.zeros(1, FEATURES)
    kernels.describe(scores, posterior, facts, alternatives, features)
    return features


def add_null_score(features: Records, best: ConsensusSet, null: NullScore) -> None:
    """Write those of the null score into the features, (1,) of `FEATURES`."""
    write_null_features(best.score, null.score, null.symmetry, features)
