"""The search itself: from a scan and a map index to the poses that explain the scan best."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from registration.layout import Records

from .context import SearchContext
from .kernels.advancing import BUDGET, EXHAUSTED, PROVEN, advance, begin_and_advance
from .kernels.planning import begin
from .kernels.sliding import search_slides, sliding_segments
from .kernels.stopping import missed_share
from .layout import FOUND, PROGRESS, RULES, Integers, record
from .options import AssociationOptions, CancelledError
from .planning_tables import Plan, Planning
from .result import SearchReport
from .sharing import Sharing
from .tables import Question
from .tuning import (
    BASE_SEGMENTS,
    CHUNK,
    DISTINCT_ANGLE,
    DISTINCT_DISTANCE,
    KEPT,
    KEPT_FOR_BEAMS,
    KEPT_SHARE,
    KEPT_SHARE_FOR_BEAMS,
    KEPT_SLIDES,
    REUSE,
    RIVAL_SHARE,
    SAMPLE_SEED,
    SAMPLES,
    SLIDE_DISTINCT_SHARE,
    SLIDE_SEGMENTS,
    SLIDE_SPACING,
    SLIDE_SPACING_FOR_BEAMS,
    TELLING_SEGMENTS,
    USUAL_CROWD,
)

NO_NOISE = np.zeros(0)


@dataclass(frozen=True, slots=True)
class Candidates:
    """What the search found.

    Attributes
    ----------
    poses : (k,) of `FOUND`, the best value first
    report : SearchReport
    """

    poses: Records
    report: SearchReport


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is looked for.

    Attributes
    ----------
    kept : int
        Poses at most.
    kept_share : float
        Of the best value, below which a pose is not kept.
    rival_share : float
        Of the best value, above which no pose may have been missed.
    allowed : float
        The greatest chance of having missed one; -1 goes through all bases.
    known : float
        A value that is known to be reached, nats: what stays below these shares of it is not looked for.
    enough : float
        A value that ends the search, nats.
    samples : int
        Consensus sets by which the chance of having missed one is told.
    """

    kept: int
    kept_share: float
    rival_share: float
    allowed: float
    known: float = 0.0
    enough: float = math.inf
    samples: int = SAMPLES

    @classmethod
    def of(cls, context: SearchContext) -> Effort:
        """Keep poses more freely where raw beams are to decide between them."""
        kept = (KEPT_FOR_BEAMS, KEPT_SHARE_FOR_BEAMS) if context.with_beams else (KEPT, KEPT_SHARE)
        return cls(*kept, RIVAL_SHARE, allowed_by(context.options))


def allowed_by(options: AssociationOptions) -> float:
    """Return the chance of having missed a better consensus set that a caller allows; -1 for none."""
    return -1.0 if options.exhaustive else 1.0 - options.confidence


def find_candidates(context: SearchContext, effort: Effort | None = None) -> Candidates:
    """Go through bases until nothing better can have been missed, the bases are used up or the deadline passes.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    effort = effort or Effort.of(context)
    if context.window is None:
        return _search(context, effort)
    # A window is searched by itself; the whole map shows whether a clearly better pose lies outside.
    within, everywhere = _search(context, effort), _search(context.anywhere(), effort)
    one, other = within.report, everywhere.report
    report = SearchReport(
        complete=one.complete and other.complete,
        exhaustive=one.exhaustive and other.exhaustive,
        confidence=min(one.confidence, other.confidence),
        bases=one.bases + other.bases,
        hypotheses=one.hypotheses + other.hypotheses,
        verified=one.verified + other.verified,
        seed=one.seed,
        sampling=one.sampling,
        rivals_above=max(one.rivals_above, other.rivals_above),
    )
    return Candidates(np.concatenate([within.poses, everywhere.poses]), report)


def _search(context: SearchContext, effort: Effort) -> Candidates:
    """Search the map, or the window of a hard prior."""
    scan, index, kept = context.lines.rows, context.index, effort.kept
    found, progress = np.zeros(kept + KEPT_SLIDES, FOUND), np.zeros(1, PROGRESS)
    progress["best_value"] = effort.known
    # A test of a pose takes longer the more walls lie where it is.
    chunk = int(CHUNK / max(1.0, index.crowd / USUAL_CROWD))
    question = context.question(_rules(effort, DISTINCT_DISTANCE))
    stopped = _go_through_bases(context, effort, question, found[:kept], progress, chunk)
    places = [*range(int(progress["count"][0]))]
    # Parallel walls alone, as in a corridor, fix the pose across them: no base shows it, yet it may explain more.
    slid = _slide(context, effort, found[kept:], progress, chunk)
    places += range(kept, kept + int(progress["count"][0]))
    if context.deadline.cancelled:
        raise CancelledError
    exhaustive = stopped == EXHAUSTED and len(scan) <= BASE_SEGMENTS
    state = dict(zip(PROGRESS.names or (), progress[0].item(), strict=True))  # a look at one field takes as long as all
    report = SearchReport(
        complete=stopped != BUDGET and slid,
        exhaustive=exhaustive,
        confidence=1.0 if exhaustive or stopped == PROVEN else 1.0 - state["missed"],
        bases=state["bases"],
        hypotheses=state["hypotheses"],
        verified=state["verified"],
        seed=context.options.seed,
        sampling=context.options.sampling,
        rivals_above=effort.rival_share,
    )
    poses = found[np.array(places, dtype=np.intp)]
    if len(places) > 1:
        poses = poses[np.argsort(-poses["value"], kind="stable")]
    return Candidates(poses, report)


@lru_cache
def _rules(effort: Effort, distinct_distance: float) -> Records:
    return record(
        RULES,
        kept_share=effort.kept_share,
        distinct_distance=distinct_distance,
        distinct_angle=DISTINCT_ANGLE,
        rival_share=effort.rival_share,
        enough=effort.enough,
    )


def _go_through_bases(
    context: SearchContext, effort: Effort, question: Question, found: Records, progress: Records, chunk: int
) -> int:
    """Fill `found` and `progress`; return why it ended, `BUDGET` where the deadline did."""
    tables, deadline, work = context.index.tables, context.deadline, context.workspace
    planning = _planning(context, effort)
    if deadline.passed:
        plan: Plan | None = begin(question, tables, planning, progress)
        stopped = BUDGET
    else:
        stopped, plan = begin_and_advance(question, tables, planning, found, progress, work, effort.allowed, chunk)
    if plan is None:
        return stopped
    if len(plan.bases) == 0:
        progress["missed"] = 0.0  # walls of which no two cross are slid
        return EXHAUSTED
    while stopped == BUDGET:
        if deadline.helped:
            stopped = Sharing(context, question, plan, found, progress, chunk).go_on(effort.allowed)
        if stopped != BUDGET or deadline.passed:
            break
        stopped = advance(question, tables, plan, found, progress, work, effort.allowed, chunk)
    if stopped in (BUDGET, EXHAUSTED) and not plan.random:
        progress["missed"] = missed_share(question, plan, progress)
    return stopped


def _planning(context: SearchContext, effort: Effort) -> Planning:
    index, count = context.index, _segments_of_bases(len(context.lines.rows))
    orders, noise, fade = _orders(count, effort.samples), NO_NOISE, math.log(REUSE)
    if context.options.sampling == "random":
        # Those with the greatest sums of the logarithm of their merit and a Gumbel variate are draws without
        # replacement with a probability by merit.
        noise, fade = np.random.default_rng(context.options.seed).gumbel(size=max(1, count * (count - 1) // 2)), 0.0
    return Planning(index.runs, index.area, *orders, fade, noise)


def _segments_of_bases(count: int) -> int:
    """Return among how many of a scan's segments bases are drawn."""
    return max((n for n in (min(count, BASE_SEGMENTS), *TELLING_SEGMENTS) if n <= count), default=0)


@lru_cache(maxsize=2 * (BASE_SEGMENTS + 1 + len(TELLING_SEGMENTS)))
def _orders(n: int, samples: int) -> tuple[Integers, Integers]:
    """Draw orders of n segments (samples, n), all as likely; return the places of each segment, too, (n, samples)."""
    orders = np.random.default_rng(SAMPLE_SEED).random((samples, n)).argsort(axis=1)
    return orders.astype(np.uint8), np.ascontiguousarray(orders.argsort(axis=1).T, dtype=np.uint8)


def _slide(context: SearchContext, effort: Effort, found: Records, progress: Records, chunk: int) -> bool:
    """Lay the longest of parallel segments on every run, and fill `found`; return whether that was completed."""
    spacing = SLIDE_SPACING_FOR_BEAMS if context.with_beams else SLIDE_SPACING
    if context.window is not None:
        spacing = min(spacing, context.window.radius)
    question = context.question(_rules(effort, SLIDE_DISTINCT_SHARE * spacing))
    tables, share = context.index.tables, effort.kept_share if context.with_beams else effort.rival_share
    progress["count"] = 0
    slid, scan, floor = True, context.lines.rows, share * float(progress["best_value"][0])
    for sliding in sliding_segments(scan, min(len(scan), BASE_SEGMENTS), floor, SLIDE_SEGMENTS).tolist():
        progress["anchor"] = progress["step"] = 0
        slid = False
        while not slid and not context.deadline.passed:
            slid = search_slides(question, tables, sliding, found, progress, context.workspace, spacing, chunk)
        if not slid:
            break
    return slid
