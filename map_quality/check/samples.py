"""Searching a sample scan in a map as it is, and as it might be."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from association import AssociationOptions, AssociationResult, Deadline, IndexingEndedError, MapIndex, Scan, mirrored
from association.causes import Cause, Mistake, find_causes
from association.context import SearchContext
from association.report import report
from association.scan.scan import scaled
from association.to_scale import ScaledSearch, estimate_factor, search_rungs, search_to_scale
from association.verdict.verdict import Verdict, judge
from registration import RigidTransform

from .tuning import BETTER_SCALED, LADDER, LADDER_SECONDS, LEAST_SHARE, SIGMAS

Way = tuple[bool, float | None]
"""Assumptions about a map: whether directions mean something, and the sigma of its lines, metres."""


@dataclass(frozen=True, slots=True)
class Trial:
    """Fit of a scan under one set of assumptions about the map.

    Attributes
    ----------
    usable : bool
    score : float
        Nats; 0 where nothing fits.
    offsets : dict of int to float
        By map segment, how far its matched scan segments are off, metres. Empty where too little of the scan fits.
    """

    usable: bool
    score: float
    offsets: Mapping[int, float]


@dataclass(frozen=True, slots=True)
class Sample:
    """Results for one scan.

    Attributes
    ----------
    result : AssociationResult
        In the map as it is.
    trials : dict of Way to Trial
    mirrored : Trial or None
        With left and right exchanged, in the map as it is; None where there was no time for it.
    mistakes : tuple of Mistake
        Without which it would fit much better.
    factor : float or None
        Factor by which its lengths fit better; None where they are right.
    moved : RigidTransform or None
        From its stated pose to the pose where it was found, in the map frame. None where either is not known.
    """

    result: AssociationResult
    trials: Mapping[Way, Trial]
    mirrored: Trial | None
    mistakes: tuple[Mistake, ...]
    factor: float | None
    moved: RigidTransform | None


def try_sample(
    index: MapIndex, scan: Scan, deadline: Deadline, *, oriented: bool, said: RigidTransform | None = None
) -> Sample:
    """Search a scan in a map as it is, and as it might be.

    Parameters
    ----------
    index : MapIndex
        Built with its directions, whatever they mean; its sigma is the map's.
    scan : Scan
    deadline : Deadline
        A trial that does not fit before it is skipped.
    oriented : bool
        True when the map states that directions mean something.
    said : RigidTransform, optional
        Pose of the scan as its sender states it, map_from_scan.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    IndexingEndedError
        When it passed before the map was indexed without its directions.
    """
    if not oriented:
        index.undirected_by(deadline)  # the search takes it from there
    began, present = time.monotonic(), (oriented, index.sigma)
    context = SearchContext.of(index, scan, None, AssociationOptions(oriented=oriented, causes=True), deadline)
    found = search_to_scale(context)
    result, trial, verdict = _judged(context, found)
    trials = {present: trial}
    for way in _other_ways(present):
        if not deadline.passed:
            with suppress(IndexingEndedError):
                trials[way] = _tried(index, scan, way, deadline)
    other = None if deadline.passed else _tried(index, mirrored(scan), present, deadline)
    # As much time as all of this took may go into mistakes.
    causes = find_causes(context, found.as_sent, verdict, began)
    known = max(trial.score for trial in trials.values())
    factor = _factor(context, known, causes)
    if factor is None and found.factor is not None:
        factor = found.factor.value
    tried = [*trials.values()] if other is None else [*trials.values(), other]
    if factor is None and not causes and not any(trial.usable for trial in tried):
        now = time.monotonic()
        until = context.deadline.within(now + max(LADDER_SECONDS, now - began))
        factor = _any_factor(replace(context, deadline=until), known)
    mistakes = tuple(cause.mistake for cause in causes if cause.mistake is not Mistake.UNIT_SCALE)
    moved = None if said is None or not result.usable or result.pose is None else result.pose.compose(said.inverse())
    return Sample(result, trials, other, mistakes, factor, moved)


def _other_ways(present: Way) -> Iterator[Way]:
    for directed in (True, False) if present[0] else (False,):
        for sigma in (present[1], *SIGMAS):
            if (directed, sigma) != present:
                yield directed, sigma


def _tried(index: MapIndex, scan: Scan, way: Way, deadline: Deadline) -> Trial:
    directed, sigma = way
    place = replace(index if directed else index.undirected_by(deadline), sigma=sigma)
    context = SearchContext.of(place, scan, None, AssociationOptions(oriented=directed), deadline)
    return _judged(context, search_to_scale(context))[1]


def _judged(context: SearchContext, found: ScaledSearch) -> tuple[AssociationResult, Trial, Verdict]:
    """Return the answer, and the trial and the verdict of the scan as it was sent.

    By these ways are compared: any may be made up for by a factor. Usable is in each what its answer is.
    """
    verdict = judge(found.context, found.explanations, off_scale=found.off_scale)
    result = report(found, verdict)
    if found.factor is None:
        return result, _trial(result), verdict
    verdict = judge(context, found.as_sent)
    trial = _trial(report(ScaledSearch(context, found.as_sent, found.as_sent), verdict))
    return result, replace(trial, usable=result.usable), verdict


def _trial(result: AssociationResult) -> Trial:
    diagnostics = result.diagnostics
    if diagnostics is None:
        return Trial(False, 0.0, {})
    enough = result.usable or diagnostics.inlier_fraction >= LEAST_SHARE
    offsets = {pair.map: pair.offset for pair in result.correspondences} if enough else {}
    return Trial(result.usable, max(0.0, diagnostics.score), offsets)


def _factor(context: SearchContext, known: float, causes: Sequence[Cause]) -> float | None:
    """Return the factor of a scan's lengths at which it scores clearly more than unscaled, `known` nats.

    Rooms between lines along the middle of walls look too large by as much as the walls are thick, at any scale.
    """
    least = BETTER_SCALED * known
    told = next((cause for cause in causes if cause.mistake is Mistake.UNIT_SCALE), None)
    if told is not None:
        return told.factor if told.score > least else None
    if not len(context.scan.measured) or context.deadline.passed:
        return None
    near = estimate_factor(context)
    if near is None or context.deadline.passed:
        return None
    way = context.options.oriented, context.index.sigma
    found = _tried(context.index, scaled(context.scan, near), way, context.deadline)
    return near if found.score > least else None


def _any_factor(context: SearchContext, known: float) -> float | None:
    """Return the factor with which a scan scores most, if that is clearly more than it does anyhow, `known` nats.

    A grid whose resolution is wrong is off by two as likely as by a hundredth.
    """
    options = AssociationOptions(oriented=context.options.oriented)
    found = search_rungs(context, LADDER, options)
    # Shrunk, a hall fits the next best room: a factor is reported only if its answer is usable.
    if found is None or found[0].score <= BETTER_SCALED * known:
        return None
    best, factor = found
    if not judge(best.context, best.explanations, off_scale=best.off_scale).usable:
        return None
    return factor if best.factor is None else factor * best.factor.value
