"""Fit a similarity to a consensus set: the pose together with the factor by which map and scan differ."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from registration import RigidTransform
from registration.layout import Floats, Records

from ..context import SearchContext
from ..layout import ESTIMATE
from .consensus_set import ConsensusSet
from .kernels.similarity import estimate_similarity, pose_of_similarity
from .tuning import LEAST_TRIMMED, TRIMMED_FITS, TRIMMED_LINES, TRIMMED_OUTLIER


@dataclass(frozen=True, slots=True)
class Similarity:
    """A similarity from the scan frame to the index frame, fitted to a consensus set.

    Attributes
    ----------
    pose : RigidTransform
        Without the factor.
    covariance : (3, 3)
        Of additive (x, y, theta), with the uncertainty of the factor.
    factor : float
        Factor on the scan's lengths.
    deviation : float
        Its standard deviation.
    more : float
        Number of walls beyond those that fix the factor; walls that the others determine poorly count in part.
    """

    pose: RigidTransform
    covariance: Floats
    factor: float
    deviation: float
    more: float


def fit_similarity(context: SearchContext, best: ConsensusSet) -> Similarity | None:
    """Fit a similarity to the sums of a consensus set; None where it does not fix one."""
    return _fit(context, best.matches)


def fit_trimmed_similarity(context: SearchContext, best: ConsensusSet) -> tuple[Similarity, float] | None:
    """Fit a similarity to a consensus set in which some lines are on wrong walls.

    Lines of which an end is off by much more than the median of all ends are left out, then it is fitted again.

    Returns
    -------
    (Similarity, float) or None
        With the median of the distances between ends and walls, metres. None where too few lines are left.
    """
    matches = best.matches.copy()
    rows = context.lines.rows[best.matched]
    walls = context.index.walls.rows[best.matches["wall"][best.matched]]
    fitted: tuple[Similarity, float] | None = None
    for _ in range(TRIMMED_FITS):
        if (matches["wall"] >= 0).sum() < TRIMMED_LINES:
            return None
        similarity = _fit(context, matches)
        if similarity is None:
            return None
        residuals = np.abs(_offsets_of_ends(similarity, rows, walls))
        left = float(np.median(residuals))
        fitted = similarity, left
        kept = residuals.max(axis=0) <= TRIMMED_OUTLIER * max(left, LEAST_TRIMMED)
        matches["wall"][best.matched] = np.where(kept, best.matches["wall"][best.matched], -1)
    return fitted


def _fit(context: SearchContext, matches: Records) -> Similarity | None:
    """Fit a similarity to matches, (n,) of `MATCH`."""
    solution, covariance, pose = np.zeros(4), np.zeros((4, 4)), np.zeros(1, ESTIMATE)
    variance, more = estimate_similarity(
        context.question_of_a_pose, context.known_walls, matches, solution, covariance, context.workspace
    )
    if variance < 0.0:
        return None
    factor, spread = pose_of_similarity(solution, covariance, pose[0])
    theta, x, y, xx, xy, xt, yy, yt, tt = pose[0].item()
    of_pose = np.array((xx, xy, xt, xy, yy, yt, xt, yt, tt)).reshape(3, 3)
    return Similarity(RigidTransform(x, y, theta), of_pose, factor, math.sqrt(spread), more)


def _offsets_of_ends(similarity: Similarity, rows: Records, walls: Records) -> Floats:
    """Return how far both ends of scan lines (n,) are off their walls (n,), (2, n) metres."""
    half = 0.5 * rows["length"] * np.array([[-1.0], [1.0]])
    ends = np.stack([rows["x"] + half * rows["dx"], rows["y"] + half * rows["dy"]], axis=-1)
    on_map = similarity.pose.apply((similarity.factor * ends).reshape(-1, 2)).reshape(ends.shape)
    offsets: Floats = walls["dx"] * on_map[..., 1] - walls["dy"] * on_map[..., 0] - walls["offset"]
    return offsets
