"""What a search found, worked out as far as the verdict weighs it."""

from __future__ import annotations

from collections.abc import Iterator

from registration import RegistrationResult
from registration.values import value

from .consensus.acceptance import Accepted
from .consensus.ranking import Ranked
from .consensus.settling import Settled
from .consensus.sight import BeamShares
from .result import SearchReport


@value(frozen=True, slots=True)
class Answer:
    """The best explanation, worked out.

    Attributes
    ----------
    best : Ranked
    accepted : Accepted
        Its consensus set in the map's own segments.
    settled : Settled
        Its pose, and what that hinges on.
    registered : RegistrationResult
        That pose on the map's own segments.
    agreement : float
        Share of directions in which the scan shows what the map does, 0 to 1.
    beams : BeamShares
        How many of the beams do not read what the map shows.
    significance : float
        Probability that chance scores as high.
    """

    best: Ranked
    accepted: Accepted
    settled: Settled
    registered: RegistrationResult
    agreement: float
    beams: BeamShares
    significance: float


@value(frozen=True, slots=True)
class Explanations:
    """What a search found.

    Attributes
    ----------
    ranked : tuple of Ranked
        Distinct; those within a hard prior's window first, the best first.
    answer : Answer or None
        The first within the window; None where there is none.
    search : SearchReport
    """

    ranked: tuple[Ranked, ...]
    answer: Answer | None
    search: SearchReport

    @property
    def rivals(self) -> Iterator[Ranked]:
        """The other explanations within the window, best first."""
        return (one for one in self.others if one.inside)

    @property
    def others(self) -> Iterator[Ranked]:
        """All explanations but that of the answer, in their order."""
        best = None if self.answer is None else self.answer.best
        return (one for one in self.ranked if one is not best)
