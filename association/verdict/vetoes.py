"""The vetoes: conditions of the contract under which an answer is not usable, whatever its probability."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from ..consensus.tuning import CONTRADICTION
from ..result import ReasonCode
from .tuning import FAR_FROM_PRIOR


@dataclass(frozen=True, slots=True)
class Findings:
    """The numbers that vetoes decide by.

    Attributes
    ----------
    complete : bool
        True if nothing was left unsearched or uncompared.
    score, score_elsewhere : float
        Of the answer, and the best of the other explanations, also outside the prior's window, nats.
    prior : float
        Log-density of a soft prior at the pose over its maximum, nats.
    outside_window : bool
        True if the pose lies outside the window of a hard prior.
    unobservable : bool
        True if the walls leave a direction of the position open.
    """

    complete: bool
    score: float = -math.inf
    score_elsewhere: float = -math.inf
    prior: float = 0.0
    outside_window: bool = False
    unobservable: bool = False


@dataclass(frozen=True, slots=True)
class Veto:
    """A condition under which an answer is not usable, and the reason that it gives."""

    name: str
    applies: Callable[[Findings], bool]
    reason: ReasonCode


INCOMPLETE = Veto("search_incomplete", lambda found: not found.complete, "search_incomplete")
VETOES: tuple[Veto, ...] = (
    Veto("better_elsewhere", lambda found: found.score_elsewhere > found.score + CONTRADICTION, "prior_contradicted"),
    Veto("far_from_prior", lambda found: found.prior < FAR_FROM_PRIOR, "prior_contradicted"),
    Veto("outside_window", lambda found: found.outside_window, "prior_contradicted"),
    INCOMPLETE,
    Veto("unobservable_direction", lambda found: found.unobservable, "unobservable_direction"),
)


def applied(findings: Findings) -> tuple[Veto, ...]:
    """Return the vetoes whose conditions the findings meet, in the order of the table."""
    return tuple(veto for veto in VETOES if veto.applies(findings))
