"""Whether a scan that cannot be used fits much better once a caller's mistake is undone."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Literal

import numpy as np

from registration import Segments
from registration.layout import Floats
from registration.limits import MAX_LENGTH, MIN_LENGTH

from .consensus.scaling import scale_near_one
from .context import SearchContext
from .explain import search_and_explain
from .explanations import Explanations
from .index.map_index import MapIndex
from .scan.extents import inner_extent
from .scan.scan import Scan, mirrored, scaled, turned_round
from .search.candidates import Effort, allowed_by
from .tuning import (
    CAUSE_CONFIDENCE,
    CAUSE_GAP,
    CAUSE_KEPT,
    CAUSE_RATIO,
    CAUSE_SHARE,
    EXCEEDING,
    GREATEST_EXTENT,
    GREATEST_SAME_GATES,
    LEAST_TIME_FOR_CAUSES,
    MOST_FOR_UNITS,
    RIVAL_SHARE,
    TIMES_FOR_CAUSES,
    USUAL_EXTENT,
    USUAL_PART,
)
from .verdict.verdict import Verdict, judge

LEAST_EXTENT = 1.5  # m; what is seen of any room
# What a scan has to be multiplied with where the map's lengths are of one unit and are taken for another, which is the
# greater one; and the reverse.
TAKEN_FOR: Mapping[float, tuple[str, str]] = {
    10.0: ("decimetres", "metres"),
    100.0: ("centimetres", "metres"),
    1000.0: ("millimetres", "metres"),
    1.0 / 0.0254: ("inches", "metres"),
    1.0 / 0.3048: ("feet", "metres"),
    25.4: ("millimetres", "inches"),
    304.8: ("millimetres", "feet"),
    2.54: ("centimetres", "inches"),
    30.48: ("centimetres", "feet"),
    12.0: ("inches", "feet"),
}
UNITS = (*TAKEN_FOR, *(1.0 / factor for factor in TAKEN_FOR))
SAME_UNIT = 0.003  # of a factor; nearer to one of units it is that


def unit_mistake(factor: float) -> str | None:
    """Return which unit of a map was taken for which other, such as ``millimetres taken for inches``.

    Parameters
    ----------
    factor : float
        Lengths of the map, in units of those of a scan.
    """
    for known, (unit, other) in TAKEN_FOR.items():
        if abs(factor / known - 1.0) < SAME_UNIT:
            return f"{unit} taken for {other}"
        if abs(factor * known - 1.0) < SAME_UNIT:
            return f"{other} taken for {unit}"
    return None


class Mistake(StrEnum):
    """What a caller may have done to a scan; the code of the warning."""

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
        What undoes it: the scan's lengths times this are metres of the map; 1 where it is another mistake.
    score : float
        Of the scan once it is undone, nats.
    sure : bool
        Whether the answer would then be usable.
    of_map : bool
        Whether the map's lengths were changed, and not the scan's.
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
    """Return what the scan as sent is worth by what counts of the changed one, nats."""
    alone = scan.viewpoint is None
    scores = (one.by_segments + one.blocked if alone else one.score for one in explanations.ranked)
    return max(scores, default=0.0)


def _undone(context: SearchContext) -> Iterator[tuple[Mistake, float, SearchContext]]:
    """Yield the search without each mistake, the likely ones first; a factor is searched for when its turn comes."""
    scan = context.scan
    if context.options.oriented:
        yield Mistake.REVERSED, 1.0, _with_scan(context, turned_round(scan))
    yield Mistake.MIRRORED, 1.0, _with_scan(context, mirrored(scan))
    for factor in _likely_map_units(context):
        yield Mistake.UNIT_SCALE, factor, _with_smaller_map(context, factor)
    for factor in _likely_units(context):
        yield Mistake.UNIT_SCALE, factor, _with_scan(context, scaled(scan, factor))
    near = scale_near_one(context)
    if near is not None:
        yield Mistake.UNIT_SCALE, near, _with_scan(context, scaled(scan, near))


def _with_scan(context: SearchContext, scan: Scan) -> SearchContext:
    return SearchContext.of(context.index, scan, None, context.options, context.deadline)


def _with_smaller_map(context: SearchContext, factor: float) -> SearchContext:
    """Divide the map by a factor: where its unit is wrong, what is measured in metres holds for the scan as it is."""
    index, options = context.index, context.options
    segments = Segments.derived(index.segments.endpoints[: index.directed] / factor)
    smaller = MapIndex.build(segments, index.sigma, oriented=options.oriented)
    return SearchContext.of(smaller, context.scan, None, options, context.deadline)


def _tried(changed: SearchContext, mistake: Mistake, factor: float, known: float) -> Cause | None:
    """Search without a mistake; None where that fits no better."""
    options = changed.options
    effort = Effort(CAUSE_KEPT, RIVAL_SHARE, RIVAL_SHARE, allowed_by(options), known)
    explanations = search_and_explain(changed, effort)
    if explanations.answer is None or explanations.answer.best.score <= known:
        return None
    best, verdict = explanations.answer.best, judge(changed, explanations)
    better = best.score > max(known + CAUSE_GAP, CAUSE_RATIO * known) and best.share >= CAUSE_SHARE
    return Cause(mistake, factor, best.score, verdict.usable) if verdict.usable or better else None


def _likely_map_units(context: SearchContext) -> list[float]:
    """Return the factors by which the map's unit may be wrong where the scan is as large as scans are.

    Scan lines are parts of walls: in the same unit their usual length is a quarter of that of walls to all of it.
    """
    index, scan = context.index, context.scan.measured.segments
    extent = inner_extent(scan)
    if not LEAST_EXTENT <= extent <= GREATEST_EXTENT or index.directed > MOST_FOR_UNITS:
        return []
    # In a map that is too small all lines are near one another, and are merged to walls that are none.
    seen, walls, pieces = _usual(scan.lengths), _usual(index.walls.longest), _usual(index.segments.lengths)
    off = {factor: factor * seen / (walls if factor > 1.0 else pieces) for factor in UNITS}
    likely = [
        factor
        for factor in UNITS
        if abs(math.log(factor)) > math.log(GREATEST_SAME_GATES)
        and USUAL_PART[0] <= off[factor] <= USUAL_PART[1]
        and extent * factor <= EXCEEDING * index.diagonal
        and float(index.segments.lengths.min()) / factor >= MIN_LENGTH
        and float(index.segments.lengths.max()) / factor <= MAX_LENGTH
    ]
    return sorted(likely, key=lambda factor: abs(math.log(off[factor])))


def _usual(lengths: Floats) -> float:
    """Return the length such that half of all length is in longer lines, metres."""
    ordered = np.sort(lengths)
    return float(ordered[np.searchsorted(np.cumsum(ordered), 0.5 * ordered.sum())])


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
