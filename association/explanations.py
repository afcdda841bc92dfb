"""The explanations of a scan: ranked consensus sets, the best of them estimated. The verdict judges them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from registration import RegistrationResult, wrap_angle
from registration.values import value

from .consensus.acceptance import Accepted
from .consensus.consensus_set import ConsensusSet
from .consensus.estimation import EstimatedPose
from .consensus.sight import BeamFractions
from .result import SearchReport
from .tuning import DISTINCT_ANGLE, SAME_PLACE


@value(frozen=True, slots=True)
class Answer:
    """The best explanation, with all that the verdict needs of it.

    Attributes
    ----------
    best : ConsensusSet
    accepted : Accepted
        Its consensus set in the map's own segments.
    estimated : EstimatedPose
        Its pose, and the leverage of each wall on it.
    registered : RegistrationResult
        That pose on the map's own segments.
    agreement : float
        Fraction of directions in which the scan shows what the map does, 0 to 1.
    beams : BeamFractions
        Fractions of the beams that do not read what the map shows.
    significance : float
        Probability that chance scores as high.
    """

    best: ConsensusSet
    accepted: Accepted
    estimated: EstimatedPose
    registered: RegistrationResult
    agreement: float
    beams: BeamFractions
    significance: float


@value(frozen=True, slots=True)
class Explanations:
    """The explanations of a scan, and how the search for them went.

    Attributes
    ----------
    ranked : tuple of ConsensusSet
        Distinct; those within a hard prior's window first, the best first.
    answer : Answer or None
        The first within the window; None where there is none.
    search : SearchReport
    """

    ranked: tuple[ConsensusSet, ...]
    answer: Answer | None
    search: SearchReport

    @property
    def alternatives(self) -> Iterator[ConsensusSet]:
        """The other explanations within the window, best first."""
        return (one for one in self.others if one.inside)

    @property
    def others(self) -> Iterator[ConsensusSet]:
        """All explanations but that of the answer, in their order."""
        best = None if self.answer is None else self.answer.best
        return (one for one in self.ranked if one is not best)


def put_first(answer: Answer, explanations: Explanations) -> Explanations:
    """Return explanations with another answer, before all others; the same ones if theirs is at that place."""
    if explanations.answer is not None and _same_place(answer.best, explanations.answer.best):
        return explanations
    others = (one for one in explanations.ranked if not _same_place(answer.best, one))
    return replace(explanations, ranked=(answer.best, *others), answer=answer)


def add_alternatives(explanations: Explanations, alternatives: Sequence[ConsensusSet]) -> Explanations:
    """Add alternatives that fit at other scales to explanations, none of them above the answer."""
    if explanations.answer is None:
        return explanations
    best, ranked = explanations.answer.best, list(explanations.ranked)
    for other in alternatives:
        one = replace(other, score=min(other.score, best.score), posterior=min(other.posterior, best.posterior))
        place = next((k for k, there in enumerate(ranked) if _same_place(one, there)), len(ranked))
        if place == len(ranked) or ranked[place].posterior < one.posterior:
            ranked[place : place + 1] = [one]
    ranked.sort(key=lambda one: (not one.inside, -one.posterior))
    return replace(explanations, ranked=tuple(ranked))


def _same_place(one: ConsensusSet, other: ConsensusSet) -> bool:
    """Return whether two poses are of one place, at whatever scales."""
    a, b = one.pose, other.pose
    return math.hypot(a.x - b.x, a.y - b.y) <= SAME_PLACE and abs(wrap_angle(a.theta - b.theta)) <= DISTINCT_ANGLE
