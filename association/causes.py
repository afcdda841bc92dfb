"""Find the mistake of a caller without which a scan that cannot be used fits much better."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Literal

from registration import Segments

from .context import SearchContext
from .explanations import Explanations
from .index.joint import JointIndex
from .index.map_index import MapIndex
from .rank_and_estimate import search_and_rank
from .scan.scan import Scan, mirrored, turned_round
from .search.candidates import Effort, allowed_by
from .to_scale import at_scale, estimate_factor
from .tuning import (
    CAUSE_CONFIDENCE,
    CAUSE_GAP,
    CAUSE_RATIO,
    CAUSE_SHARE,
    FEW_KEPT,
    LEAST_TIME_FOR_CAUSES,
    RIVAL_SHARE,
    TIMES_FOR_CAUSES,
)
from .units import likely_map_units, likely_units
from .verdict.verdict import Verdict, judge


class Mistake(StrEnum):
    """A mistake that a caller may have made with a scan; the code of the warning."""

    MIRRORED = "mirrored"
    REVERSED = "reversed"
    UNIT_SCALE = "unit_scale"

    @property
    def code(self) -> Literal["mirrored", "reversed", "unit_scale"]:
        """The code of the warning."""
        return self.value


@dataclass(frozen=True, slots=True)
class Cause:
    """A mistake without which the scan fits much better.

    Attributes
    ----------
    mistake : Mistake
    factor : float
        The correction: the scan's lengths times this are metres of the map; 1 for another mistake.
    score : float
        Of the scan once it is undone, nats.
    sure : bool
        True if the answer would then be usable.
    of_map : bool
        True if the map's lengths were changed, and not the scan's.
    """

    mistake: Mistake
    factor: float
    score: float
    sure: bool
    of_map: bool = False


def find_causes(
    context: SearchContext, explanations: Explanations, verdict: Verdict, began: float
) -> tuple[Cause, ...]:
    """Undo one mistake after the other and search again, for at most twice the time that the answer took.

    An answer may take no time where nothing fits: then 20 ms. Mistakes that the time does not suffice for are left out.

    Parameters
    ----------
    context : SearchContext
    explanations : Explanations
        Of the scan as it was sent.
    verdict : Verdict
        On them; where the answer is usable there is nothing to look for.
    began : float
        When the search began, `time.monotonic()` seconds.

    Returns
    -------
    tuple of Cause
        The first that makes the answer usable, or else those that fit much better; of factors the best.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    if verdict.usable or not context.options.causes or not len(context.scan.measured):
        return ()
    now = time.monotonic()
    deadline = context.deadline.within(now + max(LEAST_TIME_FOR_CAUSES, TIMES_FOR_CAUSES * (now - began)))
    options = replace(context.options, exhaustive=False, confidence=min(context.options.confidence, CAUSE_CONFIDENCE))
    again = replace(context, prior=None, options=options, deadline=deadline)
    found: dict[Mistake, Cause] = {}
    for mistake, factor, changed in _undone(again):
        if deadline.passed:
            break
        cause = _tried(changed, mistake, factor, _known(explanations, changed.scan))
        if cause is None:
            continue
        cause = replace(cause, of_map=changed.index is not again.index)
        if cause.sure:
            return (cause,)
        if mistake not in found or found[mistake].score < cause.score:
            found[mistake] = cause
    return tuple(found.values())


def _known(explanations: Explanations, scan: Scan) -> float:
    """Return the score of the scan as sent, by the evidence that counts in the changed one, nats."""
    alone = scan.viewpoint is None
    scores = (one.by_segments + one.blocked if alone else one.score for one in explanations.ranked)
    return max(scores, default=0.0)


def _undone(context: SearchContext) -> Iterator[tuple[Mistake, float, SearchContext]]:
    """Yield the search without each mistake, the likely ones first; a factor is searched for when its turn comes."""
    scan = context.scan
    if context.options.oriented:
        yield Mistake.REVERSED, 1.0, _with_scan(context, turned_round(scan))
    yield Mistake.MIRRORED, 1.0, _with_scan(context, mirrored(scan))
    # Smaller maps would lie too near one another: the unit of several maps is not tested.
    for factor in [] if isinstance(context.index, JointIndex) else likely_map_units(context):
        yield Mistake.UNIT_SCALE, factor, _with_smaller_map(context, factor)
    for factor in likely_units(context):
        yield Mistake.UNIT_SCALE, factor, at_scale(context, factor)
    near = estimate_factor(context)
    if near is not None:
        yield Mistake.UNIT_SCALE, near, at_scale(context, near)


def _with_scan(context: SearchContext, scan: Scan) -> SearchContext:
    return SearchContext.of(context.index, scan, None, context.options, context.deadline)


def _with_smaller_map(context: SearchContext, factor: float) -> SearchContext:
    """Divide the map by a factor: where its unit is wrong, what is measured in metres holds for the scan as it is."""
    index, options = context.index, context.options
    segments = Segments.derived(index.segments.endpoints[: index.directed] / factor)
    points = index.points.scaled(1.0 / factor)
    smaller = MapIndex.build(segments, index.sigma, oriented=options.oriented, points=points)
    return SearchContext.of(smaller, context.scan, None, options, context.deadline)


def _tried(changed: SearchContext, mistake: Mistake, factor: float, known: float) -> Cause | None:
    """Search without a mistake; None where that fits no better."""
    options = changed.options
    effort = Effort(FEW_KEPT, RIVAL_SHARE, RIVAL_SHARE, allowed_by(options), known)
    explanations = search_and_rank(changed, effort)
    if explanations.answer is None or explanations.answer.best.score <= known:
        return None
    best, verdict = explanations.answer.best, judge(changed, explanations)
    better = best.score > max(known + CAUSE_GAP, CAUSE_RATIO * known) and best.fraction >= CAUSE_SHARE
    return Cause(mistake, factor, best.score, verdict.usable) if verdict.usable or better else None
