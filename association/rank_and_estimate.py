"""From the poses of a search to explanations: ranked as consensus sets, the best of them estimated."""

from __future__ import annotations

from dataclasses import replace

from registration import RigidTransform

from .consensus.acceptance import accept, register_accepted
from .consensus.consensus_set import ConsensusSet
from .consensus.estimation import estimate_poses
from .consensus.ranking import rank_candidates
from .consensus.sight import agreement, compare_beams
from .context import SearchContext
from .explanations import Answer, Explanations
from .layout import FOUND, record
from .result import SearchReport
from .scan.views import corrected
from .search.candidates import Candidates, Effort, find_candidates

NOT_SEARCHED = SearchReport(False, False, 0.0, 0, 0, 0, 0, "ordered", 1.0)


def search_and_rank(context: SearchContext, effort: Effort | None = None) -> Explanations:
    """Search a scan, and rank the poses found; by default with the effort that the context calls for.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    return rank_and_estimate(context, find_candidates(context, effort))


def estimate_at(context: SearchContext, pose: RigidTransform) -> Explanations:
    """Rank and estimate a pose in the map, m and radians, as if a search had found that alone.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    x, y = context.index.origin
    return rank_and_estimate(
        context, Candidates(record(FOUND, x=pose.x - x, y=pose.y - y, theta=pose.theta), NOT_SEARCHED)
    )


def rank_and_estimate(context: SearchContext, candidates: Candidates) -> Explanations:
    """Rank the poses of a search as consensus sets, and estimate the pose of the best one.

    Raises
    ------
    CancelledError
        When the deadline was cancelled.
    """
    ranked, search = tuple(rank_candidates(context, candidates.poses)), _as_far_as(context, candidates)
    best = next((one for one in ranked if one.inside), None)
    return Explanations(ranked, None if best is None else _answer(context, best), search)


def _as_far_as(context: SearchContext, candidates: Candidates) -> SearchReport:
    """Return how the search went; not complete where poses were left unranked, or rays not followed."""
    as_far = context.can_look and not context.deadline.passed
    return candidates.report if as_far else candidates.report.cut_short()


def _answer(context: SearchContext, best: ConsensusSet) -> Answer | None:
    """Estimate the pose of the best explanation, and compare the scan with the map there; None without pairs.

    1. Accept correspondences with the map's own segments.
    2. Estimate the pose with the error of the walls, and the leverage of each wall.
    3. Register the scan by these correspondences: that pose is the answer.
    4. Compare what is seen with what the map shows: directions, beams, chance.
    """
    accepted = accept(context, best)
    (estimated,) = estimate_poses(context, [best], leverages=True)
    if estimated.views is not None:
        # All of the following holds where the views are estimated to have been.
        context = replace(context, scan=corrected(context.scan, estimated.views.found, estimated.views.spread))
    found = register_accepted(context, best, accepted, estimated)
    if found is None:
        return None
    registered, estimated = found
    beams = compare_beams(context, estimated)
    return Answer(best, accepted, estimated, registered, agreement(context, best), beams)
