"""Whether a scan that cannot be used fits much better once a caller's mistake is undone."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum

from registration.limits import MAX_LENGTH, MIN_LENGTH

from .candidates import Effort, allowed_by
from .context import SearchContext
from .explain import search_and_explain
from .explanations import Explanations
from .extents import inner_extent
from .scaling import scale_near_one
from .scan import Scan, mirrored, scaled, turned_round
from .tuning import (
    CAUSE_CONFIDENCE,
    CAUSE_GAP,
    CAUSE_KEPT,
    CAUSE_RATIO,
    CAUSE_SHARE,
    EXCEEDING,
    LEAST_TIME_FOR_CAUSES,
    RIVAL_SHARE,
    TIMES_FOR_CAUSES,
    USUAL_EXTENT,
)
from .verdict import Verdict, judge

LEAST_EXTENT = 1.5  # m; what is seen of any room
# What a scan may have to be multiplied with: units of ten, and feet and inches, either way.
UNITS = (1e-3, 1e3, 1e-2, 1e2, 0.1, 10.0, 0.3048, 1.0 / 0.3048, 0.0254, 1.0 / 0.0254)


class Mistake(StrEnum):
    """What a caller may have done to a scan; the code of the warning."""

    MIRRORED = "mirrored"
    REVERSED = "reversed"
    SCALE = "scale"


@dataclass(frozen=True, slots=True)
class Cause:
    """A mistake without which the scan fits much better.

    Attributes
    ----------
    mistake : Mistake
    factor : float
        What undoes it: the scan's lengths times this are metres of the map; 1 where it is another mistake.
    score : float
        Of the scan once it is undone, nats.
    sure : bool
        Whether the answer would then be usable.
    """

    mistake: Mistake
    factor: float
    score: float
    sure: bool


def find_causes(
    context: SearchContext, explanations: Explanations, verdict: Verdict, began: float
) -> tuple[Cause, ...]:
    """Undo one mistake after the other and search again, for at most twice the time that the answer took.

    An answer may take no time where nothing fits: then 20 ms. What the time does not suffice for is not told.

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
    for mistake, factor, scan in _undone(again):
        if deadline.passed:
            break
        cause = _tried(again, mistake, factor, scan, _known(explanations, scan))
        if cause is None:
            continue
        if cause.sure:
            return (cause,)
        if mistake not in found or found[mistake].score < cause.score:
            found[mistake] = cause
    return tuple(found.values())


def _known(explanations: Explanations, scan: Scan) -> float:
    """Return what the scan as sent is worth by what counts of the changed one, nats."""
    alone = scan.viewpoint is None
    scores = (one.by_segments + one.blocked if alone else one.score for one in explanations.ranked)
    return max(scores, default=0.0)


def _undone(context: SearchContext) -> Iterator[tuple[Mistake, float, Scan]]:
    """Yield the scan without each mistake, the likely ones first; a factor is searched for when its turn comes."""
    scan = context.scan
    if context.options.oriented:
        yield Mistake.REVERSED, 1.0, turned_round(scan)
    yield Mistake.MIRRORED, 1.0, mirrored(scan)
    for factor in _likely_units(context):
        yield Mistake.SCALE, factor, scaled(scan, factor)
    near = scale_near_one(context)
    if near is not None:
        yield Mistake.SCALE, near, scaled(scan, near)


def _tried(context: SearchContext, mistake: Mistake, factor: float, scan: Scan, known: float) -> Cause | None:
    """Search the scan without a mistake; None where that fits no better."""
    changed = SearchContext.of(context.index, scan, None, context.options, context.deadline)
    effort = Effort(CAUSE_KEPT, RIVAL_SHARE, RIVAL_SHARE, allowed_by(context.options), known)
    explanations = search_and_explain(changed, effort)
    if explanations.answer is None or explanations.answer.best.score <= known:
        return None
    best, verdict = explanations.answer.best, judge(changed, explanations)
    better = best.score > max(known + CAUSE_GAP, CAUSE_RATIO * known) and best.share >= CAUSE_SHARE
    return Cause(mistake, factor, best.score, verdict.usable) if verdict.usable or better else None


def _likely_units(context: SearchContext) -> list[float]:
    """Return the factors that make the scan as large as what lasers see on such a map, the usual size first."""
    segments = context.scan.measured.segments
    extent = inner_extent(segments)
    if extent <= 0.0:
        return []
    shortest, longest = float(segments.lengths.min()), float(segments.lengths.max())
    likely = [
        factor
        for factor in UNITS
        if LEAST_EXTENT <= extent * factor <= EXCEEDING * context.index.diagonal
        and shortest * factor >= MIN_LENGTH
        and longest * factor <= MAX_LENGTH
    ]
    return sorted(likely, key=lambda factor: abs(math.log(extent * factor / USUAL_EXTENT)))
