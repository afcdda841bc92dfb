"""Estimate how probable the best explanation is among its alternatives: perceptual aliasing.

Alternatives are compared three times.

- As they were scored.
- By what the scan shows. Suppose two rooms are equal but for a cupboard that the map shows in one of them. Today the
  cupboard is gone: the scan fits the other room without a fault, and many beams contradict the right one. But a
  single removed cupboard explains all of these beams. If another place explains everything that the scan does
  show, each thing that is missing there counts little therefore, however many beams miss it.
- With walls taken to be off by more than the answer shows. Suppose a building repeats itself and its map is
  centimetres off. A wall at the right place may then lie beyond the gates, and a similar place may fit better by luck.
  The error of the walls is estimated from the place that fits best, and of many similar places one always fits well. A
  misfit of centimetres is therefore no evidence against a place.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from registration.layout import Floats, Records

from ..consensus.consensus_set import ConsensusSet
from ..consensus.ranking import score_again
from ..context import SearchContext
from ..explanations import Answer
from ..layout import ALTERNATIVE, COMPARED
from ..scan.scan_lines import ScanLines
from ..tuning import LEAST_OFF_WALLS, LOOSE_WALLS, MODEL_OFFSET
from .inconsistencies import absences
from .kernels import alternatives as kernels
from .tuning import (
    ABSENCE,
    ALTERNATIVE_TEMPERATURE,
    LOOSE_ALTERNATIVES,
    LOOSE_BEAMS,
    LOOSE_FACTOR,
    NO_ALTERNATIVE,
)


def compare_alternatives(best: ConsensusSet, others: Sequence[ConsensusSet]) -> Records:
    """Compare the best explanation with others; return (k,) of `ALTERNATIVE`."""
    explanations = np.array([(one.posterior, one.chi_square, one.count) for one in (best, *others)], COMPARED)
    alternatives = np.zeros(len(others), ALTERNATIVE)
    kernels.compare(explanations, alternatives)
    return alternatives


def probability_among(alternatives: Records) -> float:
    """Return the probability of the best explanation among those that are about as good, above 0 and up to 1."""
    return kernels.probability_among(alternatives)


def probability_by_shown(context: SearchContext, best: ConsensusSet, others: Sequence[ConsensusSet]) -> float:
    """Return the probability of the best explanation where what the scan does not show counts little, up to 1.

    An alternative is behind by ``shown + min(rest, limit)`` nats. ``shown`` is the difference of the scores of all
    matches and of the prior. The rest is what lines of sight, beams and the log-determinant make. The limit is
    `ABSENCE` for each thing that the map shows there and the scan does not, one at least.
    """
    if not others:
        return 1.0
    shown = np.array([_shown(one) for one in (best, *others)])
    behind = shown[0] - shown[1:]
    rest = np.array([best.posterior - one.posterior for one in others]) - behind
    limits = np.full(len(others), ABSENCE)
    near = (behind + np.minimum(rest, limits) < NO_ALTERNATIVE + ABSENCE) & (rest > limits)
    limits[near] = np.maximum(ABSENCE, absences(context, best, [others[k] for k in np.flatnonzero(near).tolist()]))
    behind += np.minimum(rest, limits)
    return float(1.0 / (1.0 + np.exp(-np.maximum(0.0, behind) / ALTERNATIVE_TEMPERATURE).sum()))


def _shown(one: ConsensusSet) -> float:
    """Return the scores of the matches and of the prior of an explanation, nats."""
    return float(np.maximum(0.0, one.matches["score"]).sum()) + one.posterior - one.score


def probability_with_loose_walls(context: SearchContext, answer: Answer, others: Sequence[ConsensusSet]) -> float:
    """Return the probability of the best explanation among the next ones where walls may be off by more, up to 1.

    1 where the map is declared to be exact to `LEAST_OFF_WALLS`, and without alternatives.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    declared = context.index.sigma
    if not others or (declared is not None and declared < LEAST_OFF_WALLS):
        return 1.0
    if declared is None:
        sigma = _loose_sigma(answer.estimated.wall_sigma)
    else:
        sigma = min(LOOSE_FACTOR * declared, max(declared, LOOSE_WALLS))
    lines = ScanLines.of(context.scan, sigma, context.options, context.lines.given)
    explanations = (answer.best, *others[:LOOSE_ALTERNATIVES])
    scores = score_again(context.instead(context.scan, lines), explanations)
    return _probability_of_first(explanations, scores)


def _loose_sigma(wall_sigma: float) -> float:
    """Return the standard deviation of a wall's offset beyond `MODEL_OFFSET`, metres, for an estimate of its whole."""
    loose = max(LOOSE_WALLS, LOOSE_FACTOR * wall_sigma)
    return math.sqrt(loose * loose - MODEL_OFFSET * MODEL_OFFSET)


def _probability_of_first(explanations: Sequence[ConsensusSet], scores: Floats) -> float:
    """Return the probability of the first explanation among all, from the present scores of their segments, (k,) nats.

    The prior counts in full; the beams' part, which depends on centimetres, counts by `LOOSE_BEAMS`.
    """
    prior_and_beams = [one.posterior - one.score + LOOSE_BEAMS * (one.score - one.by_segments) for one in explanations]
    posteriors = scores + np.array(prior_and_beams)
    others = np.exp(np.minimum(0.0, posteriors[1:] - posteriors[0]) / ALTERNATIVE_TEMPERATURE)
    return 1.0 / (1.0 + float(others.sum()))
