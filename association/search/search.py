"""The search: draw a base, propose poses, score them, ask the stopping rule."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from registration.layout import Floats, Records, floats

from ..consensus.kernels.distinct import pick_distinct
from ..consensus.kernels.scoring import score_poses
from ..context import SearchContext
from ..deadline import CancelledError
from ..layout import ESTIMATE, HYPOTHESIS, MATCH, RULE, SET_SCORE, record
from ..options import AssociationOptions
from ..result import SearchReport
from ..tables import ScoreRules
from ..tuning import COMPLETE_ABOVE, DISTINCT_ANGLE, DISTINCT_DISTANCE
from .kernels.proposals import reject, slide_line, sweep_bases
from .stopping import Bases
from .tuning import (
    BASE_LINES,
    KEPT,
    KEPT_FOR_BEAMS,
    KEPT_FRACTION,
    KEPT_FRACTION_FOR_BEAMS,
    MIN_CROSSING_BASE,
    PARALLEL_SINE,
    POSED,
    PRUNED,
    SLIDE_DISTINCT,
    SLIDE_LINES,
    SLIDE_SPACING,
    SLIDE_SPACING_FOR_BEAMS,
)


@dataclass(frozen=True, slots=True)
class Candidates:
    """The poses that a search found.

    Attributes
    ----------
    poses : (k,) of `ESTIMATE`, the best value first
    report : SearchReport
    """

    poses: Records
    report: SearchReport


@dataclass(frozen=True, slots=True)
class Effort:
    """The limits of a search.

    Attributes
    ----------
    kept : int
        Poses that are stored at most, and
    kept_fraction : float
        the fraction of the best value that they reach.
    complete_above : float
        Fraction of the best value above which no pose is to be missed.
    allowed : float
        Probability of having missed one, that is allowed; -1: all bases are searched.
    known : float
        A value that is known to be reached, nats.
    enough : float
        The value that ends the search, nats.
    """

    kept: int
    kept_fraction: float
    complete_above: float
    allowed: float
    known: float = 0.0
    enough: float = math.inf

    @classmethod
    def of(cls, context: SearchContext) -> Effort:
        """Keep poses more freely where raw beams are to decide between them."""
        kept, fraction = (KEPT_FOR_BEAMS, KEPT_FRACTION_FOR_BEAMS) if context.with_beams else (KEPT, KEPT_FRACTION)
        return cls(max(kept, context.index.least_kept), fraction, COMPLETE_ABOVE, allowed_by(context.options))


def allowed_by(options: AssociationOptions) -> float:
    """Return the probability of having missed a better consensus set that a caller allows; -1 for none."""
    return -1.0 if options.exhaustive else 1.0 - options.confidence


def search(context: SearchContext, effort: Effort | None = None) -> Candidates:
    """Search until no better pose can have been missed, no base is left or the deadline passes.

    With a hard prior the window is searched, and then the whole map: the answer comes from the window, and a much
    better pose outside contradicts the prior.

    Parameters
    ----------
    context : SearchContext
    effort : Effort or None
        By default as much as the options call for.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    effort = effort or Effort.of(context)
    found = _Search(context, effort).run()
    if context.window is None:
        return found
    everywhere = _Search(context.anywhere(), effort).run()
    one, other = found.report, everywhere.report
    report = replace(
        one,
        complete=one.complete and other.complete,
        exhaustive=one.exhaustive and other.exhaustive,
        confidence=min(one.confidence, other.confidence),
        bases=one.bases + other.bases,
        hypotheses=one.hypotheses + other.hypotheses,
        verified=one.verified + other.verified,
        complete_above=max(one.complete_above, other.complete_above),
    )
    return Candidates(np.concatenate([found.poses, everywhere.poses]), report)


class _BestPoses:
    """The best poses so far, at most one within a distance and an angle."""

    def __init__(self, context: SearchContext, effort: Effort, distance: float, best_value: float) -> None:
        self._context, self._kept, self._distance = context, effort.kept, distance
        self._poses, self._values = np.empty(PRUNED * effort.kept, ESTIMATE), np.empty(PRUNED * effort.kept)
        self._held = 0
        within = context.window is not None
        self.rule = record(RULE, kept_fraction=effort.kept_fraction, best_value=best_value, within=within)

    @property
    def best_value(self) -> float:
        """The best value so far, nats."""
        return float(self.rule["best_value"][0])

    def offer(self, poses: Records, values: Floats) -> None:
        """Take poses with their values."""
        taken = 0
        while taken < len(values):
            count = min(len(values) - taken, len(self._values) - self._held)
            own, given = slice(self._held, self._held + count), slice(taken, taken + count)
            self._poses[own], self._values[own] = poses[given], values[given]
            self._held, taken = self._held + count, taken + count
            if self._held == len(self._values):
                self._prune()

    def _prune(self) -> None:
        held = np.flatnonzero(self._values[: self._held] >= self.rule["kept_fraction"][0] * self.best_value)
        poses, values = self._poses[held], self._values[held]
        places = self._context.at_sensor(poses)
        chosen = pick_distinct(places, values, self._kept, self._distance, DISTINCT_ANGLE, 0.0, 0.0)
        self._held = len(chosen)
        self._poses[: self._held], self._values[: self._held] = poses[chosen], values[chosen]
        if self._held == self._kept:
            self.rule["least_value"][0] = self._values[self._held - 1]

    def result(self) -> tuple[Records, Floats]:
        """Return the distinct ones with their values, the best first."""
        if self._held:
            self._prune()
        return self._poses[: self._held], self._values[: self._held]


class _Search:
    """One search of the map, or of the window of a hard prior."""

    def __init__(self, context: SearchContext, effort: Effort) -> None:
        self.context, self.effort = context, effort
        scan = context.lines.rows
        self.scan, self.question, self.sweep = scan, context.question, context.index.tables.sweep
        self._make_room(POSED)
        self.matches = np.zeros((1, len(scan)), MATCH)
        self.hypotheses = self.verified = 0
        self.complete = True

    def _make_room(self, hypotheses: int) -> None:
        self.posed, self.poses = np.empty(hypotheses, HYPOTHESIS), np.empty(hypotheses, ESTIMATE)
        self.scores, self.possible = np.zeros(hypotheses, SET_SCORE), np.empty(hypotheses)

    def run(self) -> Candidates:
        """Search bases, then parallel lines."""
        context, effort = self.context, self.effort
        best = _BestPoses(context, effort, DISTINCT_DISTANCE, effort.known)
        bases = Bases(context)
        self._search_bases(best, bases)
        spacing = SLIDE_SPACING_FOR_BEAMS if context.with_beams else SLIDE_SPACING
        if context.window is not None:
            spacing = min(spacing, context.window.radius)
        slides = _BestPoses(context, effort, SLIDE_DISTINCT * spacing, best.best_value)
        if self.complete:
            self._search_parallel(slides, spacing)
        if context.deadline.cancelled:
            raise CancelledError
        of_bases, values = best.result()
        of_slides, others = slides.result()
        poses = np.empty(len(values) + len(others), ESTIMATE)
        poses[: len(values)], poses[len(values) :] = of_bases, of_slides
        order = np.argsort(-np.concatenate([values, others]), kind="stable")
        return Candidates(poses[order], self._report(bases))

    def _report(self, bases: Bases) -> SearchReport:
        exhaustive = bases.count == bases.number and len(self.scan) <= BASE_LINES
        proven = bases.bound <= 0.0 or exhaustive
        report = SearchReport(
            complete=True,
            exhaustive=exhaustive,
            confidence=1.0 if proven else 1.0 - bases.missed,
            bases=bases.count,
            hypotheses=self.hypotheses,
            verified=self.verified,
            seed=self.context.options.seed,
            sampling=self.context.options.sampling,
            complete_above=self.effort.complete_above,
        )
        return report if self.complete else report.cut_short()

    def _search_bases(self, best: _BestPoses, bases: Bases) -> None:
        """Search bases, the best first, until the stopping rule ends it."""
        effort, gains, chains = self.effort, np.ascontiguousarray(self.scan["gain"]), len(self.sweep.chains)
        while best.best_value < effort.enough:
            best.rule["least_freedom"] = bases.least_freedom(effort.kept_fraction * best.best_value)
            needed = effort.complete_above * best.best_value
            drawn = bases.draw(needed + bases.least_freedom(needed), effort.allowed)
            propose = partial(sweep_bases, self.question, drawn, self.sweep)
            if not len(drawn) or not self._propose(propose, len(drawn) * chains, gains, best):
                return

    def _search_parallel(self, slides: _BestPoses, spacing: float) -> None:
        """Lay the longest of parallel lines on every chain, where these may gain more than the best pose does."""
        scan, m = self.scan, min(len(self.scan), BASE_LINES)
        if not m:
            return
        fraction = self.effort.kept_fraction if self.context.with_beams else self.effort.complete_above
        floor = fraction * slides.best_value
        dx, dy = floats(scan, "dx", "dy")
        sines = dx[:m, None] * dy - dy[:m, None] * dx
        parallel = np.abs(sines) < PARALLEL_SINE
        reach = parallel @ scan["gain"]
        chosen: list[int] = []
        for i in np.flatnonzero(reach > floor).tolist():
            if len(chosen) < SLIDE_LINES and np.count_nonzero(parallel[i, chosen]) < 2:
                chosen.append(i)
        for i in chosen:
            # Poses that explain other lines, too, are found from bases.
            own = np.where(np.abs(sines[i]) < MIN_CROSSING_BASE, scan["gain"], 0.0)
            propose = partial(slide_line, self.question, i, self.sweep, spacing)
            if not self._propose(propose, len(self.sweep.chains), own, slides):
                return

    def _propose(
        self, propose: Callable[[int, Records], tuple[int, int]], steps: int, gains: Floats, best: _BestPoses
    ) -> bool:
        """Propose poses, reject most of them, score the rest; return False where the deadline passes."""
        context, tables, first = self.context, self.context.index.tables, 0
        rules = ScoreRules(best.rule, True)
        while first < steps:
            if context.deadline.passed:
                self.complete = False
                return False
            following, count = propose(first, self.posed)
            if count < 0:
                self._make_room(2 * len(self.posed))
                continue
            first = following
            self.hypotheses += count
            kept = reject(self.question, tables.raster, gains, self.posed[:count], best.rule, self.poses, self.possible)
            if kept:
                some = self.poses[np.argsort(-self.possible[:kept], kind="stable")]
                refined, good = score_poses(
                    self.question, tables.place, some, rules, self.scores, self.matches, context.work
                )
                self.verified += refined
                best.offer(some[:good], self.scores["value"][:good])
        return True
