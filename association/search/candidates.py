"""The search itself: from a scan and a map index to the poses that explain the scan best."""

from __future__ import annotations

import math
from functools import cache, lru_cache

import numpy as np

from registration.layout import Records
from registration.values import value

from ..context import SearchContext
from ..layout import FOUND, HOW, PROGRESS, RULES, Integers, record
from ..options import AssociationOptions, CancelledError
from ..result import SearchReport
from ..tables import Question
from ..tuning import (
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
    SLIDE_SPACING,
    SLIDE_SPACING_FOR_BEAMS,
    TELLING_SEGMENTS,
    USUAL_CROWD,
    USUAL_LINES,
)
from .kernels.advancing import BUDGET, EXHAUSTED, PROVEN
from .kernels.planning import begin
from .kernels.searching import go_on, put_in_order, search
from .kernels.stopping import missed_share, restrict
from .planning_tables import Plan, Planning

NO_NOISE = np.zeros(0)
COUNT, BASES, HYPOTHESES, VERIFIED, MISSED = map(
    (PROGRESS.names or ()).index, ("count", "bases", "hypotheses", "verified", "missed")
)


@value(frozen=True, slots=True)
class Candidates:
    """What the search found.

    Attributes
    ----------
    poses : (k,) of `FOUND`, the best value first
    report : SearchReport
    """

    poses: Records
    report: SearchReport


@value(frozen=True, slots=True)
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


def find_candidates(context: SearchContext, effort: Effort | None = None, *, chunk: int | None = None) -> Candidates:
    """Go through bases until nothing better can have been missed, the bases are used up or the deadline passes.

    Parameters
    ----------
    context : SearchContext
    effort : Effort or None
        By default what the context wants.
    chunk : int or None
        Tests of walls between two looks at the clock; by default some milliseconds of them.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    effort = effort or Effort.of(context)
    if context.window is None:
        return _search(context, effort, chunk)
    # A window is searched by itself; the whole map shows whether a clearly better pose lies outside.
    within, everywhere = _search(context, effort, chunk), _search(context.anywhere(), effort, chunk)
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
        complete_above=max(one.complete_above, other.complete_above),
    )
    return Candidates(np.concatenate([within.poses, everywhere.poses]), report)


@value(frozen=True, slots=True)
class Begun:
    """A search as the kernels are handed it.

    Attributes
    ----------
    effort : Effort
    question : Question
    planning : Planning
    found : (k,) of `FOUND`, to write to
    progress : (1,) of `PROGRESS`
    how : (1,) of `HOW`
    """

    effort: Effort
    question: Question
    planning: Planning
    found: Records
    progress: Records
    how: Records

    @classmethod
    def of(cls, context: SearchContext, effort: Effort, chunk: int | None = None) -> Begun:
        """Prepare a search of the map, or of the window of a hard prior; `chunk` as in `find_candidates`."""
        # A pose takes longer to score the more lines the scan has, and the more walls lie where each is.
        crowd, lines = context.index.crowd / USUAL_CROWD, len(context.lines.rows) / USUAL_LINES
        budget = int((chunk or CHUNK) / (max(1.0, crowd) * max(1.0, lines)))
        how, rules = _limits(effort, context.window and context.window.radius, budget, with_beams=context.with_beams)
        found, progress = np.zeros(effort.kept + KEPT_SLIDES, FOUND), record(PROGRESS, best_value=effort.known)
        return cls(effort, context.question(rules), _planning(context, effort), found, progress, how)

    def search(self, context: SearchContext) -> tuple[int, Plan | None]:
        """Search as far as the budget lets it; return why bases were left, and the plan to `go_on` with, if any."""
        tables, work = context.index.tables, context.workspace
        return search(self.question, tables, self.planning, self.found, self.progress, work, self.how)

    def plan(self, context: SearchContext) -> tuple[int, Plan]:
        """Return what `search` does, without having gone through any base."""
        return BUDGET, begin(self.question, context.index.tables, self.planning, self.progress)

    def go_on(self, context: SearchContext, stopped: int, plan: Plan | None) -> Candidates:
        """Go on where `search` left it.

        Raises
        ------
        CancelledError
            When the deadline was cancelled.
        """
        deadline, found, progress, how = context.deadline, self.found, self.progress, self.how
        if plan is not None:
            if not progress["left"][0]:
                stopped = _leave_bases(context, self.question, plan, found, progress, how)
            while not (progress["done"][0] or deadline.passed):
                go_on(self.question, context.index.tables, plan, found, progress, context.workspace, how)
        if deadline.cancelled:
            raise CancelledError
        slid = plan is None or bool(progress["done"][0])
        if not slid:
            put_in_order(found, progress, how)
        return _found(context, self.effort, found, progress, stopped, slid=slid)


def _search(context: SearchContext, effort: Effort, chunk: int | None) -> Candidates:
    """Search the map, or the window of a hard prior."""
    begun = Begun.of(context, effort, chunk)
    started = begun.plan(context) if context.deadline.passed else begun.search(context)
    return begun.go_on(context, *started)


def _found(
    context: SearchContext, effort: Effort, found: Records, progress: Records, stopped: int, *, slid: bool
) -> Candidates:
    exhaustive = stopped == EXHAUSTED and len(context.lines.rows) <= BASE_SEGMENTS
    state = progress[0].item()  # a look at one field takes as long as all
    report = SearchReport(
        complete=True,
        exhaustive=exhaustive,
        confidence=1.0 if exhaustive or stopped == PROVEN else 1.0 - state[MISSED],
        bases=state[BASES],
        hypotheses=state[HYPOTHESES],
        verified=state[VERIFIED],
        seed=context.options.seed,
        sampling=context.options.sampling,
        complete_above=effort.rival_share,
    )
    return Candidates(found[: state[COUNT]], report if stopped != BUDGET and slid else report.cut_short())


def _leave_bases(
    context: SearchContext, question: Question, plan: Plan, found: Records, progress: Records, how: Records
) -> int:
    """Go on with the bases of a plan until they are left; return why, `BUDGET` where the deadline ended them."""
    tables, deadline, work = context.index.tables, context.deadline, context.workspace
    if len(plan.bases) == 0:
        progress["missed"], progress["left"] = 0.0, 1
        return EXHAUSTED
    stopped = BUDGET
    while stopped == BUDGET and not deadline.passed:
        stopped = go_on(question, tables, plan, found, progress, work, how)
    if stopped in (BUDGET, EXHAUSTED) and not plan.random:
        progress["missed"] = missed_share(question, plan, progress)
    progress["left"] = 1
    return stopped


@lru_cache
def _limits(effort: Effort, radius: float | None, budget: int, *, with_beams: bool) -> tuple[Records, Records]:
    """Return how far a search goes, (1,) of `HOW`, and which poses of bases and slides are kept, (2,) of `RULES`.

    `radius` is that of a hard prior's window, if there is one. Both are read-only in all but name: searches share them.
    """
    spacing = SLIDE_SPACING_FOR_BEAMS if with_beams else SLIDE_SPACING
    if radius is not None:
        spacing = min(spacing, radius)
    share = effort.kept_share if with_beams else effort.rival_share
    how = np.array([(effort.allowed, spacing, share, effort.kept, budget)], HOW)
    of_bases = effort.kept_share, DISTINCT_DISTANCE, DISTINCT_ANGLE, effort.rival_share, effort.enough
    of_slides = effort.kept_share, SLIDE_DISTINCT_SHARE * spacing, *of_bases[2:]
    return how, np.array([of_bases, of_slides], RULES)


def _planning(context: SearchContext, effort: Effort) -> Planning:
    index, count = context.index, segments_of_bases(len(context.lines.rows))
    orders, noise, fade = orders_of(count, effort.samples), NO_NOISE, math.log(REUSE)
    if context.options.sampling == "random":
        # Those with the greatest sums of the logarithm of their merit and a Gumbel variate are draws without
        # replacement with a probability by merit.
        noise, fade = np.random.default_rng(context.options.seed).gumbel(size=max(1, count * (count - 1) // 2)), 0.0
    return Planning(index.runs, index.area, *orders, fade, noise)


def segments_of_bases(count: int) -> int:
    """Return among how many of a scan's segments bases are drawn."""
    return max((n for n in (min(count, BASE_SEGMENTS), *TELLING_SEGMENTS) if n <= count), default=0)


@lru_cache(maxsize=2 * (BASE_SEGMENTS + 1 + len(TELLING_SEGMENTS)))
def orders_of(n: int, samples: int) -> tuple[Integers, Integers]:
    """Return orders of n segments (samples, n), all as likely, and the places of each segment in them, (n, samples).

    Those of few segments are what is left of orders of more: to draw them anew takes ten times as long, for each number
    of segments that a scan has for the first time.
    """
    drawn = _drawn(max(n, BASE_SEGMENTS), samples)
    orders, ranks = np.empty((samples, n), np.uint8), np.empty((n, samples), np.uint8)
    restrict(drawn, orders, ranks)
    return orders, ranks


@cache
def _drawn(n: int, samples: int) -> Integers:
    return np.random.default_rng(SAMPLE_SEED).random((samples, n)).argsort(axis=1).astype(np.uint8)
