"""The main path: from a scan and a map index to a pose with its verdict."""

from __future__ import annotations

import time

import numpy as np

from registration import RigidTransform
from registration.values import value

from .causes import find_causes
from .context import SearchContext
from .deadline import Deadline
from .explanations import Explanations, put_first
from .index.map_index import MapIndex
from .last_view import LastView, search_last_view
from .layout import FOUND, record
from .options import AssociationOptions, Prior
from .rank_and_estimate import estimate_at, rank_and_estimate
from .report import report, with_causes
from .result import AssociationResult, Status
from .scan.scan import Scan
from .search.branch_and_bound import match_points
from .search.candidates import Candidates, find_candidates
from .to_scale import ScaledSearch, put_to_scale
from .verdict.verdict import Verdict, judge

DEFAULT_OPTIONS = AssociationOptions()


@value(frozen=True, slots=True)
class Stages:
    """The stages of an answer.

    Attributes
    ----------
    found : ScaledSearch
        The search, and its explanations.
    verdict : Verdict
        On them; of a drive whose last view alone is the answer, on the whole drive.
    last : LastView
        Of a drive that is not usable: its last view alone.
    result : AssociationResult
        The answer.
    """

    found: ScaledSearch
    verdict: Verdict
    last: LastView
    result: AssociationResult

    @property
    def context(self) -> SearchContext:
        """The inputs of the search, with the scan to scale."""
        return self.found.context

    @property
    def explanations(self) -> Explanations:
        """The explanations that the answer was put together from."""
        return self.found.explanations


def associate(
    index: MapIndex,
    scan: Scan,
    prior: Prior | None = None,
    options: AssociationOptions = DEFAULT_OPTIONS,
    deadline: Deadline | None = None,
) -> AssociationResult:
    """Find where in a map a scan was taken, without knowing which segment is which.

    1. Search: propose poses from bases of two scan segments, verify them, grow and shrink their consensus sets.
    2. Explain: rank the best poses with the lines of sight, the beams and the prior, and work out the best of them.
    3. Search again to scale, if scan and map differ by a factor near one according to the best explanation.
    4. Judge: how likely the best explanation is right, and whether a robot may use it.
    5. If it may not: search by the ends of beams, too. A pose that explains the scan better is put to scale and judged.
       If the ends of beams leave no doubt of another pose, that is the answer; it may not be used.
    6. Search the last view of a drive alone, where the drive may not be used: its answer stands where both agree.
    7. Find causes, where it may not: search the scan without each of a caller's usual mistakes.

    Parameters
    ----------
    index : MapIndex
    scan : Scan
        In the sensor's frame.
    prior : SoftPrior, HardPrior or None
        In the map frame.
    options : AssociationOptions
    deadline : Deadline or None
        When it passes, the best so far is the answer and ``search.complete`` is False.

    Returns
    -------
    AssociationResult

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    began = time.monotonic()
    return run_stages(SearchContext.of(index, scan, prior, options, deadline or Deadline()), began).result


def run_stages(context: SearchContext, began: float) -> Stages:
    """Search, rank, estimate and judge as `associate` describes; `began` is its start, `time.monotonic()` seconds.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    candidates = find_candidates(context)
    explanations = rank_and_estimate(context, candidates)
    found = put_to_scale(context, explanations)
    verdict = judge(found.context, found.explanations, off_scale=found.off_scale)
    if not verdict.usable:
        found, verdict = _search_by_points(context, candidates, found, verdict)
    last = search_last_view(found.context, verdict)
    if last.result is not None:
        return Stages(found, verdict, last, last.result)
    verdict = verdict if last.complete else verdict.cut_short()
    result = report(found, verdict)
    result = with_causes(result, find_causes(context, found.explanations, verdict, began))
    return Stages(found, verdict, last, result)


def _search_by_points(
    context: SearchContext, candidates: Candidates, found: ScaledSearch, verdict: Verdict
) -> tuple[ScaledSearch, Verdict]:
    """Search by the ends of beams in addition to bases; return the former answer if that finds no better one.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    answer = None if verdict.status is Status.NO_MATCH else found.explanations.answer
    here = np.zeros(0, FOUND)
    if answer is not None:
        at = answer.best.pose
        here = record(FOUND, x=at.x - context.index.origin[0], y=at.y - context.index.origin[1], theta=at.theta)
    matches = match_points(context, candidates.poses, here)
    if matches is None:
        return found, verdict
    if len(matches.poses) and not context.deadline.passed:
        more = Candidates(np.concatenate([candidates.poses, matches.poses]), candidates.report)
        by_points = put_to_scale(context, rank_and_estimate(context, more))
        if by_points.score > found.score:
            found, verdict = by_points, judge(by_points.context, by_points.explanations, off_scale=by_points.off_scale)
    if context.deadline.passed or not matches.complete:
        return found.cut_short(), verdict.cut_short()
    if matches.decisive is None or verdict.usable or context.prior is not None:
        return found, verdict
    return _decided_by_points(context, found, verdict, matches.decisive)


def _decided_by_points(
    context: SearchContext, found: ScaledSearch, verdict: Verdict, pose: RigidTransform
) -> tuple[ScaledSearch, Verdict]:
    """Make the pose at which most beams end on walls the answer; the best one by score is its first alternative.

    It is not usable, because an alternative with a higher score makes it as likely wrong as right. `pose` is in the
    index frame.
    """
    x, y = context.index.origin
    there = estimate_at(context, RigidTransform(pose.x + x, pose.y + y, pose.theta))
    if there.answer is None:
        return found, verdict
    explanations = put_first(there.answer, found.explanations)
    if explanations is not found.explanations:
        found = ScaledSearch(context, explanations, found.as_sent)
    elif verdict.status is not Status.NO_MATCH:
        return found, verdict
    return found, judge(found.context, explanations, off_scale=found.off_scale, on_map=True)
