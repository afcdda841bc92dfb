"""Search a scan, rank the poses, estimate the best one; again where the scan suggests a scale or a rotation."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from registration import RegistrationResult, RigidTransform
from registration.layout import Floats

from .consensus.acceptance import Accepted, accept, register_accepted
from .consensus.consensus_set import ConsensusSet
from .consensus.estimator import Estimate, estimate
from .consensus.ranking import rank
from .consensus.tuning import USUAL_WALL_ERROR
from .context import SearchContext
from .result import SearchReport
from .scan.scan import corrected_scan
from .scan.views import corrected
from .search.search import Effort, search
from .tuning import (
    DOUBTING_DEVIATIONS,
    LEAST_FACTOR,
    LEAST_TURN,
    MOST_FACTOR,
    MOST_SEARCHES,
    OFF_SCALE,
    SHOWN_TURN,
    SUGGESTED,
)


@dataclass(frozen=True, slots=True)
class Answer:
    """The best explanation, estimated.

    Attributes
    ----------
    best : ConsensusSet
    accepted : Accepted
        Its consensus set in the map's own segments.
    estimate : Estimate
    registered : RegistrationResult
        The pairs at the pose.
    pose : RigidTransform
        Map frame from scan frame.
    covariance : (3, 3) float64
    """

    best: ConsensusSet
    accepted: Accepted
    estimate: Estimate
    registered: RegistrationResult
    pose: RigidTransform
    covariance: Floats


@dataclass(frozen=True, slots=True)
class Explanations:
    """The explanations of a scan, and how the search for them went.

    Attributes
    ----------
    ranked : tuple of ConsensusSet
        Distinct; those within a hard prior's window first, the best first.
    answer : Answer or None
        The first within the window; None where there is none.
    search : SearchReport
    scale, turn : float
        Factor on the scan that was searched, and the angle by which its sensor turned from the first beam to the last.
    """

    ranked: tuple[ConsensusSet, ...]
    answer: Answer | None
    search: SearchReport
    scale: float = 1.0
    turn: float = 0.0

    @property
    def wall_sigma(self) -> float:
        """The standard deviation of the walls' own errors, metres."""
        return USUAL_WALL_ERROR if self.answer is None else self.answer.estimate.wall_sigma

    @property
    def shown_turn(self) -> float:
        """By how much the sensor turned during the scan, as the walls show it, radians; 0 where they do not."""
        found = None if self.answer is None else self.answer.estimate
        if found is None or not found.with_columns:
            return 0.0
        turn = self.turn + found.turn[0]
        return turn if abs(turn) > max(SHOWN_TURN, DOUBTING_DEVIATIONS * found.turn[1]) else 0.0

    @property
    def others(self) -> Iterator[ConsensusSet]:
        """All explanations but that of the answer, in their order."""
        best = None if self.answer is None else self.answer.best
        return (one for one in self.ranked if one is not best)


def explain_scan(context: SearchContext) -> tuple[SearchContext, Explanations]:
    """Search a scan and estimate the best pose; return the explanations, and the context of the scan that was searched.

    A scan that suggests a scale other than the map's, or a rotation during the sweep, is corrected for it and searched
    again, as long as it explains more. A scale has to explain more by the odds against it: most maps are to scale, and
    a few lines are laid better at some other one.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    found = _explain(context, 1.0, 0.0)
    for _ in range(MOST_SEARCHES - 1):
        if found.answer is None or context.deadline.passed:
            break
        factor, turn = _scale_of(found.answer.estimate), _turn_of(found.answer.estimate)
        if factor == 1.0 and turn == 0.0:
            break
        again = context.with_scan(corrected_scan(context.scan, factor, turn))
        better = _explain(again, factor * found.scale, turn + found.turn)
        charge = OFF_SCALE if found.scale == 1.0 != factor else 0.0
        if better.answer is None or better.answer.best.posterior - charge <= found.answer.best.posterior:
            break
        context, found = again, better
    return context, found


def _scale_of(found: Estimate) -> float:
    """Return the factor on the scan by which map and scan differ, 1 where it is small, or not suggested."""
    strain, deviations = found.strain
    common = 0.5 * float(strain[0] + strain[1])
    shown = abs(common) > SUGGESTED * 0.5 * math.hypot(deviations[0], deviations[1])
    return 1.0 + common if shown and LEAST_FACTOR <= abs(common) <= MOST_FACTOR else 1.0


def _turn_of(found: Estimate) -> float:
    """Return the angle by which the sensor turned during the scan, radians, 0 where it is small, or not suggested."""
    turn, deviation = found.turn
    return turn if abs(turn) > max(LEAST_TURN, DOUBTING_DEVIATIONS * deviation) else 0.0


def _explain(context: SearchContext, scale: float, turn: float) -> Explanations:
    candidates = search(context, Effort.of(context))
    ranked = tuple(rank(context, candidates.poses))
    best = next((one for one in ranked if one.inside), None)
    complete = context.can_look and not context.deadline.passed
    report = candidates.report if complete else candidates.report.cut_short()
    answer = None if best is None else answer_of(context, best, scaled=scale != 1.0, turned=turn != 0.0)
    return Explanations(ranked, answer, report, scale, turn)


def answer_of(context: SearchContext, best: ConsensusSet, *, scaled: bool, turned: bool) -> Answer | None:
    """Estimate the pose of the best explanation; None without pairs.

    If nothing but the pose was solved for, it is that at which the pairs register.
    """
    found = estimate(context, best, scaled=scaled, turned=turned)
    if found is None:
        return None
    accepted = accept(context, best, found.pose)
    if not len(accepted.pairs):
        return None
    if len(found.found):
        context = context.with_scan(corrected(context.scan, found.found, found.spread), context.lines)
    alone = not found.with_columns and not len(found.found) and not found.free and not found.degenerate
    pose, covariance = context.in_map(found.pose), found.covariance
    registered = register_accepted(context, best, accepted, found.wall_sigma, None if alone else pose)
    if registered.pose is not None and alone and registered.covariance is not None:
        pose, covariance = registered.pose, registered.covariance
    elif alone and context.options.estimator != "one_step":
        registered = register_accepted(context, best, accepted, found.wall_sigma, pose)
    elif registered.pose is not None:
        pose = registered.pose
    return Answer(best, accepted, found, registered, pose, covariance)
