"""A similarity fitted to the matches of a pose: what the pose is where map and scan differ by a factor."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from registration import RigidTransform
from registration.layout import Floats

from ..context import SearchContext
from ..layout import ESTIMATE
from .kernels.similarity import pose_of_similarity, settle_similarity
from .ranking import Ranked


@dataclass(frozen=True, slots=True)
class Similarity:
    """A similarity from the scan frame to the index frame, fitted to a consensus set.

    Attributes
    ----------
    pose : RigidTransform
        Without the factor.
    covariance : (3, 3)
        Of additive (x, y, theta), with what is not known of the factor.
    factor : float
        What the scan's lengths have to be multiplied with.
    deviation : float
        Its standard deviation.
    more : float
        How many more walls there are than it takes to fix it; those that others say little of count as parts.
    """

    pose: RigidTransform
    covariance: Floats
    factor: float
    deviation: float
    more: float


def fit_similarity(context: SearchContext, best: Ranked) -> Similarity | None:
    """Fit a similarity to the sums of a consensus set; None where it does not fix one."""
    solution, covariance, pose = np.zeros(4), np.zeros((4, 4)), np.zeros(1, ESTIMATE)
    variance, more = settle_similarity(
        context.question_of_a_pose, context.known_walls, best.matches, solution, covariance, context.workspace
    )
    if variance < 0.0:
        return None
    factor, spread = pose_of_similarity(solution, covariance, pose[0])
    theta, x, y, xx, xy, xt, yy, yt, tt = pose[0].item()
    of_pose = np.array((xx, xy, xt, xy, yy, yt, xt, yt, tt)).reshape(3, 3)
    return Similarity(RigidTransform(x, y, theta), of_pose, factor, math.sqrt(spread), more)
