"""The search itself: from a scan and a map index to the poses that explain the scan best."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from registration.layout import Records

from .context import SearchContext
from .kernels.planning import BUDGET, EXHAUSTED, PROVEN, advance, plan_bases
from .kernels.proposing import search_slides
from .layout import FOUND, PROGRESS, RULES, Plan, record
from .options import CancelledError
from .result import SearchReport
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
    PARALLEL_SINE,
    RIVAL_SHARE,
    SAMPLE_SEED,
    SAMPLE_WORDS,
    SLIDE_DISTINCT_SHARE,
    SLIDE_SEGMENTS,
    SLIDE_SPACING,
    SLIDE_SPACING_FOR_BEAMS,
    USUAL_CROWD,
)


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


def find_candidates(context: SearchContext) -> Candidates:
    """Go through bases until nothing better can have been missed, the bases are used up or the deadline passes.

    Poses are kept more freely when raw beams are to decide between them.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    if context.window is None:
        return _search(context)
    # A window is searched by itself; the whole map shows whether a clearly better pose lies outside.
    within, everywhere = _search(context), _search(context.anywhere())
    one, other = within.report, everywhere.report
    report = SearchReport(
        complete=one.complete and other.complete,
        exhaustive=one.exhaustive and other.exhaustive,
        confidence=min(one.confidence, other.confidence),
        bases=one.bases + other.bases,
        hypotheses=one.hypotheses + other.hypotheses,
        verified=one.verified + other.verified,
        seed=one.seed,
    )
    return Candidates(np.concatenate([within.poses, everywhere.poses]), report)


def _search(context: SearchContext) -> Candidates:
    """Search the map, or the window of a hard prior."""
    scan, index = context.segments.rows, context.index
    beams = context.with_beams
    kept, share = (KEPT_FOR_BEAMS, KEPT_SHARE_FOR_BEAMS) if beams else (KEPT, KEPT_SHARE)
    found = np.zeros(kept + KEPT_SLIDES, FOUND)
    progress = record(PROGRESS, base=-1, slide=-np.inf, bound=scan["gain"].sum(), missed=1.0)
    rules = _rules(share, DISTINCT_DISTANCE)
    # A test of a pose takes longer the more walls lie where it is.
    chunk = int(CHUNK / max(1.0, index.crowd / USUAL_CROWD))
    stopped = _go_through_bases(context, rules, found[:kept], progress, chunk)
    places = list(range(int(progress["count"][0])))
    # Parallel walls alone, as in a corridor, fix the pose across them: no base shows it, yet it may explain more.
    slid = _slide(context, rules, found[kept:], progress, chunk)
    places += range(kept, kept + int(progress["count"][0]))
    if context.deadline.cancelled:
        raise CancelledError
    order = np.argsort(-found["value"][places], kind="stable")
    report = SearchReport(
        complete=stopped != BUDGET and slid,
        exhaustive=stopped == EXHAUSTED and len(scan) <= BASE_SEGMENTS,
        confidence=1.0 if stopped in (EXHAUSTED, PROVEN) else 1.0 - float(progress["missed"][0]),
        bases=int(progress["bases"][0]),
        hypotheses=int(progress["hypotheses"][0]),
        verified=int(progress["verified"][0]),
        seed=context.options.seed,
    )
    return Candidates(found[np.array(places, dtype=np.intp)[order]], report)


@lru_cache
def _rules(kept_share: float, distinct_distance: float) -> Records:
    return record(
        RULES,
        kept_share=kept_share,
        distinct_distance=distinct_distance,
        distinct_angle=DISTINCT_ANGLE,
        rival_share=RIVAL_SHARE,
    )


def _go_through_bases(context: SearchContext, rules: Records, found: Records, progress: Records, chunk: int) -> int:
    """Fill `found` and `progress`; return why it ended, `BUDGET` where the deadline did."""
    question, tables = context.question(rules), context.index.tables
    plan = _plan(context)
    allowed = -1.0 if context.options.exhaustive else 1.0 - context.options.confidence
    stopped = EXHAUSTED if len(plan.bases) == 0 else BUDGET
    while stopped == BUDGET and not context.deadline.passed:
        stopped = advance(question, tables, plan, found, progress, context.workspace, allowed, chunk)
    return stopped


def _plan(context: SearchContext) -> Plan:
    scan, index = context.segments.rows, context.index
    n = min(len(scan), BASE_SEGMENTS)
    return Plan(
        bases=plan_bases(scan, n, index.runs, index.area),
        uses=np.zeros(n),
        residual=scan["gain"].copy(),
        best_gains=-np.sort(-scan["gain"][:n]),
        inliers=_sampled_inliers(n),
        missing=np.full((n, SAMPLE_WORDS), ~np.uint64(0)),
    )


@lru_cache(maxsize=BASE_SEGMENTS + 1)
def _sampled_inliers(n: int) -> NDArray[np.uint64]:
    """Sample consensus sets among n segments: ``[m, i]`` says for 64 samples a word whether i is in a set of m + 1.

    All sets of a size are as likely. A better consensus set has so many segments at least, whichever they are.
    """
    draws = np.random.default_rng(SAMPLE_SEED).random((SAMPLE_WORDS * 64, n))
    ranks = np.argsort(np.argsort(draws, axis=1), axis=1).T
    bits = np.packbits(ranks[None] <= np.arange(n)[:, None, None], axis=-1)
    return np.ascontiguousarray(bits).view(np.uint64)


def _slide(context: SearchContext, rules: Records, found: Records, progress: Records, chunk: int) -> bool:
    """Lay the longest of parallel segments on every run, and fill `found`; return whether that was completed."""
    spacing = SLIDE_SPACING_FOR_BEAMS if context.with_beams else SLIDE_SPACING
    if context.window is not None:
        spacing = min(spacing, context.window.radius)
    kept_share = float(rules["kept_share"][0])
    question = context.question(_rules(kept_share, SLIDE_DISTINCT_SHARE * spacing))
    tables, share = context.index.tables, kept_share if context.with_beams else RIVAL_SHARE
    progress["count"] = 0
    slid = True
    for sliding in _sliding_segments(context.segments.rows, share * float(progress["best_value"][0])):
        progress["anchor"] = progress["step"] = 0
        slid = False
        while not slid and not context.deadline.passed:
            slid = search_slides(question, tables, sliding, found, progress, context.workspace, spacing, chunk)
        if not slid:
            break
    return slid


def _sliding_segments(scan: Records, floor: float) -> list[int]:
    """Pick the two longest segments of each class of parallel ones that may explain more than `floor` nats."""
    few = scan[:BASE_SEGMENTS]
    parallel = np.abs(np.outer(few["dx"], scan["dy"]) - np.outer(few["dy"], scan["dx"])) < PARALLEL_SINE
    promising = parallel @ scan["gain"] > floor
    chosen: list[int] = []
    for i in np.nonzero(promising)[0]:
        if len(chosen) < SLIDE_SEGMENTS and parallel[i, chosen].sum() < 2:
            chosen.append(int(i))
    return chosen
