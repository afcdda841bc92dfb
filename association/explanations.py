"""The explanations of a scan: ranked consensus sets, the best of them estimated. The verdict judges them."""

from __future__ import annotations

import math
from collections.abc import Iterator

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
    """

    best: ConsensusSet
    accepted: Accepted
    estimated: EstimatedPose
    registered: RegistrationResult
    agreement: float
    beams: BeamFractions


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


def _same_place(one: ConsensusSet, other: ConsensusSet) -> bool:
    """Return whether two poses are of one place, at whatever scales."""
    a, b = one.pose, other.pose
    return math.hypot(a.x - b.x, a.y - b.y) <= SAME_PLACE and abs(wrap_angle(a.theta - b.theta)) <= DISTINCT_ANGLE
