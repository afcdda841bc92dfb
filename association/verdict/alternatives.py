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

None of the three is right for every map. A weighted mean of their logarithms agrees best with how often answers are
right; it leaves places that are equal in all three the same probability. The least of the three decides whether an
answer is usable: one thing that may have been moved, or centimetres, must not decide alone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from registration.layout import Floats, Records
from registration.values import value

from ..consensus.beams import rays_of
from ..consensus.consensus_set import ConsensusSet
from ..consensus.ranking import score_again
from ..consensus.tuning import MOST_BEAMS, NEAR
from ..context import SearchContext
from ..explanations import Answer
from ..layout import ALTERNATIVE, COMPARED
from ..scan.scan_lines import ScanLines
from ..tuning import LEAST_OFF_WALLS, LOOSE_WALLS, MODEL_OFFSET
from .inconsistencies import absences, readings_of
from .kernels import alternatives as kernels
from .tuning import (
    ABSENCE,
    COMPARISON_WEIGHTS,
    LOOSE_ALTERNATIVES,
    LOOSE_BEAMS,
    LOOSE_FACTOR,
    LOOSE_TEMPERATURE,
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
    return float(1.0 / (1.0 + np.exp(-np.maximum(0.0, behind)).sum()))


@value(frozen=True, slots=True)
class AmongAlternatives:
    """The probability of the best explanation among its alternatives, by three comparisons, above 0 and up to 1.

    Attributes
    ----------
    as_scored : float
    by_shown : float
        Things that the scan does not show count little.
    with_loose_walls : float or None
        Walls may be off by more; None on an exact map, and after the deadline.
    """

    as_scored: float
    by_shown: float
    with_loose_walls: float | None

    @property
    def made(self) -> tuple[float, ...]:
        """The comparisons that were made."""
        two = self.as_scored, self.by_shown
        return two if self.with_loose_walls is None else (*two, self.with_loose_walls)

    @property
    def mean(self) -> float:
        """Their geometric mean by `COMPARISON_WEIGHTS`."""
        weights = COMPARISON_WEIGHTS[: len(self.made)]
        nats = sum(weight * math.log(one) for weight, one in zip(weights, self.made, strict=True))
        return math.exp(nats / sum(weights))

    @property
    def least(self) -> float:
        """The least of them."""
        return min(self.made)


def compare_three_ways(
    context: SearchContext, answer: Answer, others: Sequence[ConsensusSet], alternatives: Records
) -> AmongAlternatives:
    """Compare an answer with its alternatives, (k,) of `ALTERNATIVE`, in all three ways.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    return AmongAlternatives(
        probability_among(alternatives),
        probability_by_shown(context, answer.best, others),
        probability_with_loose_walls(context, answer, others),
    )


def _shown(one: ConsensusSet) -> float:
    """Return the scores of the matches and of the prior of an explanation, nats."""
    return float(np.maximum(0.0, one.matches["score"]).sum()) + one.posterior - one.score


def probability_with_loose_walls(
    context: SearchContext, answer: Answer, others: Sequence[ConsensusSet]
) -> float | None:
    """Return the probability of the best explanation among the next ones where walls may be off by more, up to 1.

    None where the map is declared to be exact to `LEAST_OFF_WALLS`, and after the deadline.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    declared = context.index.sigma
    if context.deadline.passed or (declared is not None and declared < LEAST_OFF_WALLS):
        return None
    if not others:
        return 1.0
    if declared is None:
        sigma = _loose_sigma(answer.estimated.wall_sigma)
    else:
        sigma = min(LOOSE_FACTOR * declared, max(declared, LOOSE_WALLS))
    lines = ScanLines.of(context.scan, sigma, context.options, context.lines.given)
    explanations = (answer.best, *others[:LOOSE_ALTERNATIVES])
    scores = score_again(context.instead(context.scan, lines), explanations)
    priors = [one.posterior - one.score for one in explanations]
    posteriors = scores + priors + _loose_beams(context, explanations, math.hypot(sigma, MODEL_OFFSET))
    weights = np.exp(np.minimum(0.0, posteriors[1:] - posteriors[0]) / LOOSE_TEMPERATURE)
    return 1.0 / (1.0 + float(weights.sum()))


def _loose_beams(context: SearchContext, explanations: Sequence[ConsensusSet], sigma: float) -> Floats:
    """Return the beams' part of each score, (k,) nats, where a beam reads a wall within some of its deviations.

    Centimetres are left open then, but not whether a thing is there. 0 without beams, and where rays cannot be
    followed.
    """
    if not context.with_beams or not context.can_look:
        return np.zeros(len(explanations))
    rays, wider = rays_of(context, MOST_BEAMS), max(1.0, LOOSE_BEAMS * sigma / NEAR)
    return np.array([readings_of(context, rays, one, wider)[:, 0].sum() for one in explanations])


def _loose_sigma(wall_sigma: float) -> float:
    """Return the standard deviation of a wall's offset beyond `MODEL_OFFSET`, metres, for an estimate of its whole."""
    loose = max(LOOSE_WALLS, LOOSE_FACTOR * wall_sigma)
    return math.sqrt(loose * loose - MODEL_OFFSET * MODEL_OFFSET)
