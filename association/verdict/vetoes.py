"""The vetoes: what speaks against an answer whatever its probability, in one ordered table.

A veto follows from the contract, or from failures that the features do not show (measured). ``docs/dev/benchmarks.md``
has the number of right and wrong answers that each rejects.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from enum import StrEnum

from registration.values import value

from ..consensus.tuning import CONTRADICTION
from ..result import ReasonCode, Status
from .tuning import FAR_FROM_PRIOR, LEAST_IN_STEP, MIRRORED_BETTER, MOST_BEYOND, MOST_DISPLACED


@value(frozen=True, slots=True)
class Findings:
    """The numbers that vetoes decide by.

    Attributes
    ----------
    complete : bool
        True if the deadline ended neither the search nor the comparison of its result.
    score : float
        Of the answer, nats; minus infinity without an answer.
    score_elsewhere : float
        The best of all other explanations, also of those that the prior excludes; minus infinity without one.
    prior : float
        Log-density of the soft prior at the answer over that at its mean, nats; 0 without one.
    outside_window : bool
        True if the pose left the window of a hard prior when it was registered.
    unobservable : bool
        True if the position is open along a direction.
    few_walls : bool
        True if few walls fix the pose, and one of them alone decides.
    in_step : float
        Fraction of the beams of a drive's exact views that read the walls, over that of all views; 1 otherwise.
    off_scale : bool
        True if scan and map differ by a factor that is too great to be corrected.
    beyond_tolerance : float
        Probability by the covariance that the pose is off by more than `TOLERANCE`, 0 to 1.
    displaced_walls : float
        Fraction of the scan's length that is parallel to walls of the map, at 0.1 to 0.35 m from them; 0 to 1.
    turned : float
        By how much the robot seems to have turned during the scan, rad; 0 if its walls do not show it.
    mirrored_better : float
        Score of the mirrored scan over the answer's, less 1; 0 where it is less, or was not searched.
    """

    complete: bool
    score: float = -math.inf
    score_elsewhere: float = -math.inf
    prior: float = 0.0
    outside_window: bool = False
    unobservable: bool = False
    few_walls: bool = False
    in_step: float = 1.0
    off_scale: bool = False
    beyond_tolerance: float = 0.0
    displaced_walls: float = 0.0
    turned: float = 0.0
    mirrored_better: float = 0.0


class Origin(StrEnum):
    """The origin of a veto: the contract of the API, or failures on recorded and drawn data."""

    CONTRACT = "contract"
    MEASURED = "measured"


EVERY = frozenset(Status)


@value(frozen=True, slots=True)
class Veto:
    """A condition under which an answer is not usable.

    Attributes
    ----------
    name : str
    applies : callable
        The predicate.
    reasons : tuple of str
        Codes that the answer gives.
    origin : Origin
    caps : Status or None
        The best status of an answer to which it applies; None where it leaves the status as it is.
    counts_with : frozenset of Status
        Statuses of the answer with which it counts. With another one, the status itself is the reason.
    settles : bool
        True if nothing that is compared later can make the answer usable, so that the comparison is left out.
    message : str or None
        Of the last of the reasons, in place of the usual one.
    """

    name: str
    applies: Callable[[Findings], bool]
    reasons: tuple[ReasonCode, ...]
    origin: Origin
    caps: Status | None = None
    counts_with: frozenset[Status] = EVERY
    settles: bool = False
    message: str | None = None


MIRRORED = (
    "The scan fits this map better with left and right exchanged. Check whether the laser is mounted upside down, and "
    "whether this is the right map."
)
OFF_SCALE = (
    "The scan fits this map better with its lengths changed by more than 4 %. Check that scan and map are in metres, "
    "and that this is the right map."
)
IMPRECISE = (
    "The walls in view determine the pose too roughly: it may be off by more than 0.3 m or 3 degrees. Scan from "
    "another place."
)
DISPLACED = (
    "Much of the scan is parallel to walls of the map, at one to three decimetres from them. Check the map: it may be "
    "distorted, or show the middle of the walls."
)
TURNED = (
    "The angles of the scan are distorted: the robot turned during it, or `angle_increment` is wrong. Send `twist` and "
    "`time_increment`, or scan again at rest."
)
BETTER_ELSEWHERE = Veto(
    "better_elsewhere",
    lambda found: found.score_elsewhere > found.score + CONTRADICTION,
    ("prior_contradicted",),
    Origin.CONTRACT,
    caps=Status.AMBIGUOUS,
    settles=True,
)
FAR_FROM_ITS_PRIOR = Veto(
    "far_from_prior", lambda found: found.prior < FAR_FROM_PRIOR, ("prior_contradicted",), Origin.CONTRACT
)
OUTSIDE_WINDOW = Veto(
    "outside_window",
    lambda found: found.outside_window,
    ("prior_contradicted",),
    Origin.CONTRACT,
    counts_with=EVERY - {Status.NO_MATCH},
)
INCOMPLETE = Veto("search_incomplete", lambda found: not found.complete, ("search_incomplete",), Origin.CONTRACT)
UNOBSERVABLE = Veto(
    "unobservable_direction",
    lambda found: found.unobservable,
    ("unobservable_direction",),
    Origin.CONTRACT,
    caps=Status.DEGENERATE,
    counts_with=frozenset({Status.DEGENERATE}),
    settles=True,
)
FEW_WALLS = Veto(
    "few_walls",
    lambda found: found.few_walls,
    ("insufficient_evidence", "single_wall"),
    Origin.MEASURED,
    caps=Status.AMBIGUOUS,
    counts_with=frozenset({Status.AMBIGUOUS}),
    settles=True,
)
TOO_ROUGH = Veto(
    "imprecise",
    lambda found: found.beyond_tolerance > MOST_BEYOND,
    ("insufficient_evidence",),
    Origin.MEASURED,
    caps=Status.AMBIGUOUS,
    counts_with=frozenset({Status.AMBIGUOUS}),
    settles=True,
    message=IMPRECISE,
)
OUT_OF_STEP = Veto(
    "out_of_step",
    lambda found: found.in_step < LEAST_IN_STEP,
    ("map_mismatch",),
    Origin.MEASURED,
    caps=Status.AMBIGUOUS,
    counts_with=frozenset({Status.AMBIGUOUS}),
)
OFF_ITS_SCALE = Veto(
    "off_scale",
    lambda found: found.off_scale,
    ("map_mismatch",),
    Origin.MEASURED,
    caps=Status.AMBIGUOUS,
    counts_with=frozenset({Status.AMBIGUOUS}),
    message=OFF_SCALE,
)
DISPLACED_WALLS = Veto(
    "displaced_walls",
    lambda found: found.displaced_walls > MOST_DISPLACED,
    ("map_mismatch",),
    Origin.MEASURED,
    caps=Status.AMBIGUOUS,
    counts_with=frozenset({Status.AMBIGUOUS}),
    settles=True,
    message=DISPLACED,
)
TURNED_MEANWHILE = Veto(
    "turned",
    lambda found: found.turned > 0.0,
    ("map_mismatch",),
    Origin.MEASURED,
    caps=Status.AMBIGUOUS,
    counts_with=frozenset({Status.AMBIGUOUS}),
    settles=True,
    message=TURNED,
)
MIRRORED_FITS_BETTER = Veto(
    "mirrored",
    lambda found: found.mirrored_better >= MIRRORED_BETTER,
    ("not_on_map",),
    Origin.MEASURED,
    caps=Status.AMBIGUOUS,
    counts_with=frozenset({Status.AMBIGUOUS}),
    message=MIRRORED,
)

VETOES: tuple[Veto, ...] = (
    BETTER_ELSEWHERE,
    FAR_FROM_ITS_PRIOR,
    OUTSIDE_WINDOW,
    INCOMPLETE,
    UNOBSERVABLE,
    FEW_WALLS,
    TOO_ROUGH,
    OUT_OF_STEP,
    OFF_ITS_SCALE,
    DISPLACED_WALLS,
    TURNED_MEANWHILE,
    MIRRORED_FITS_BETTER,
)


def applied(findings: Findings) -> tuple[Veto, ...]:
    """Return the vetoes whose conditions the findings meet, in the order of the table."""
    return tuple(veto for veto in VETOES if veto.applies(findings))


def counted(vetoes: tuple[Veto, ...], status: Status) -> tuple[Veto, ...]:
    """Return those of some vetoes that count with a status."""
    return tuple(veto for veto in vetoes if status in veto.counts_with)


def contradict_prior(vetoes: tuple[Veto, ...]) -> bool:
    """Return whether one of some vetoes is that the answer contradicts its prior."""
    return any("prior_contradicted" in veto.reasons for veto in vetoes)
