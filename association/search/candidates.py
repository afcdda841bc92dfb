"""The search itself: from a scan and a map index to the poses that explain the scan best."""

from __future__ import annotations

import math
from functools import cache, lru_cache

import numpy as np

from registration.layout import Records
from registration.values import value

from ..context import SearchContext
from ..deadline import CancelledError
from ..layout import RULES, Integers, record
from ..options import AssociationOptions
from ..result import SearchReport
from ..tuning import DISTINCT_ANGLE, DISTINCT_DISTANCE, RIVAL_SHARE
from .kernels.searching import search
from .kernels.stopping import restrict
from .layout import EXHAUSTED, INTERRUPTED, LIMITS, PROVEN, STATISTICS
from .tables import Sampling
from .tuning import (
    BASE_SEGMENTS,
    KEPT,
    KEPT_FOR_BEAMS,
    KEPT_SHARE,
    KEPT_SHARE_FOR_BEAMS,
    REUSE,
    SAMPLE_SEED,
    SAMPLES,
    SLIDE_DISTINCT_SHARE,
    SLIDE_SPACING,
    SLIDE_SPACING_FOR_BEAMS,
    TELLING_SEGMENTS,
)

NO_NOISE = np.zeros(0)


@value(frozen=True, slots=True)
class Candidates:
    """The poses that the search found, with its report.

    Attributes
    ----------
    poses : (k,) of `FOUND`, the best value first
    report : SearchReport
    """

    poses: Records
    report: SearchReport


@value(frozen=True, slots=True)
class Effort:
    """The limits of a search for candidates.

    Attributes
    ----------
    kept : int
        Poses at most.
    kept_share : float
        Of the best value, below which a pose is not stored.
    rival_share : float
        Of the best value, above which no pose may have been missed.
    allowed : float
        The greatest probability of having missed one; -1 goes through all bases.
    known : float
        A value that is known to be reached, nats: poses below these fractions of it are not looked for.
    enough : float
        A value that ends the search, nats.
    samples : int
        Number of consensus sets by which the probability of having missed one is estimated.
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
        kept, share = (KEPT_FOR_BEAMS, KEPT_SHARE_FOR_BEAMS) if context.with_beams else (KEPT, KEPT_SHARE)
        return cls(max(kept, context.index.least_kept), share, RIVAL_SHARE, allowed_by(context.options))


def allowed_by(options: AssociationOptions) -> float:
    """Return the probability of having missed a better consensus set that a caller allows; -1 for none."""
    return -1.0 if options.exhaustive else 1.0 - options.confidence


def find_candidates(context: SearchContext, effort: Effort | None = None) -> Candidates:
    """Search until no better pose can have been missed, no base is left or the deadline passes.

    With a hard prior its window is searched, and then the whole map: whether a clearly better pose lies outside.

    Parameters
    ----------
    context : SearchContext
    effort : Effort or None
        By default that of the context.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    effort = effort or Effort.of(context)
    if context.window is None:
        return _search(context, effort)
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
        complete_above=max(one.complete_above, other.complete_above),
    )
    return Candidates(np.concatenate([within.poses, everywhere.poses]), report)


def _search(context: SearchContext, effort: Effort) -> Candidates:
    """Search the map, or the window of a hard prior."""
    limits, rules = _limits(effort, context.window and context.window.radius, with_beams=context.with_beams)
    question, sampling, statistics = context.question(rules), _sampling(context, effort), record(STATISTICS)
    with context.deadline.watched() as stop:
        poses = search(question, context.index.tables, sampling, limits, statistics, context.workspace, stop)
    if context.deadline.cancelled:
        raise CancelledError
    return Candidates(poses, _report(context, effort, statistics))


def _report(context: SearchContext, effort: Effort, statistics: Records) -> SearchReport:
    bases, hypotheses, verified, why, missed, _ = statistics[0].item()  # one look at all fields takes as long as at one
    exhaustive = why == EXHAUSTED and len(context.lines.rows) <= BASE_SEGMENTS
    report = SearchReport(
        complete=True,
        exhaustive=exhaustive,
        confidence=1.0 if exhaustive or why == PROVEN else 1.0 - missed,
        bases=bases,
        hypotheses=hypotheses,
        verified=verified,
        seed=context.options.seed,
        sampling=context.options.sampling,
        complete_above=effort.rival_share,
    )
    return report.cut_short() if why == INTERRUPTED else report


@lru_cache
def _limits(effort: Effort, radius: float | None, *, with_beams: bool) -> tuple[Records, Records]:
    """Return how far a search goes, (1,) of `LIMITS`, and which poses of bases and slides are stored, (2,) of `RULES`.

    `radius` is that of a hard prior's window, if there is one. Searches share both, which nothing may change.
    """
    spacing = SLIDE_SPACING_FOR_BEAMS if with_beams else SLIDE_SPACING
    if radius is not None:
        spacing = min(spacing, radius)
    fraction = effort.kept_share if with_beams else effort.rival_share
    limits = np.array([(effort.allowed, effort.known, spacing, fraction, effort.kept)], LIMITS)
    of_bases = effort.kept_share, DISTINCT_DISTANCE, DISTINCT_ANGLE, effort.rival_share, effort.enough
    of_slides = effort.kept_share, SLIDE_DISTINCT_SHARE * spacing, *of_bases[2:]
    return limits, np.array([of_bases, of_slides], RULES)


def _sampling(context: SearchContext, effort: Effort) -> Sampling:
    index, count = context.index, segments_of_bases(len(context.lines.rows))
    orders, noise, fade = orders_of(count, effort.samples), NO_NOISE, math.log(REUSE)
    if context.options.sampling == "random":
        # Those with the greatest sums of the logarithm of their merit and a Gumbel variate are draws without
        # replacement with a probability by merit.
        noise, fade = np.random.default_rng(context.options.seed).gumbel(size=max(1, count * (count - 1) // 2)), 0.0
    return Sampling(index.chains, index.area, *orders, fade, noise)


def segments_of_bases(count: int) -> int:
    """Return among how many of a scan's segments bases are drawn."""
    return max((n for n in (min(count, BASE_SEGMENTS), *TELLING_SEGMENTS) if n <= count), default=0)


@lru_cache(maxsize=2 * (BASE_SEGMENTS + 1 + len(TELLING_SEGMENTS)))
def orders_of(n: int, samples: int) -> tuple[Integers, Integers]:
    """Return orders of n segments (samples, n), all as likely, and the places of each segment in them, (n, samples).

    Those of few segments are what is left of orders of more: to draw them again takes ten times as long, for each
    number of segments that a scan has for the first time.
    """
    drawn = _drawn(max(n, BASE_SEGMENTS), samples)
    orders, ranks = np.empty((samples, n), np.uint8), np.empty((n, samples), np.uint8)
    restrict(drawn, orders, ranks)
    return orders, ranks


@cache
def _drawn(n: int, samples: int) -> Integers:
    return np.random.default_rng(SAMPLE_SEED).random((samples, n)).argsort(axis=1).astype(np.uint8)
