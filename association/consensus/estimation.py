"""Estimate poses together with the error of the map's walls, and poses as they would be without each wall."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain, repeat
from typing import Any

import numpy as np

from registration import RigidTransform
from registration.kernels import MAX_DEVIATION
from registration.layout import Floats, Records
from registration.values import value

from ..context import SearchContext
from ..layout import ESTIMATED, LEVERAGE
from ..scan.scan import Views
from .consensus_set import ConsensusSet, matches_of, poses_of
from .kernels import pose_estimation as kernels
from .tuning import COMMON_WALL_ERROR, ESTIMATED_AT_ONCE, LEAST_KNOWN_VARIANCE, ONE_OF_MANY
from .view_estimation import EstimatedViews, SeenOnWalls

NO_LEVERAGES = np.zeros(0, LEVERAGE)


@value(frozen=True, slots=True)
class EstimatedPose:
    """A pose with its covariance, where walls are as far off as their residuals show.

    Attributes
    ----------
    pose : RigidTransform
        Index frame from scan frame.
    covariance : (3, 3)
        Of additive (x, y, theta).
    wall_sigma : float
        Standard deviation of the walls' own offsets, metres: the map's, or estimated.
    weakest : float
        Standard deviation of the position along its weakest direction if walls are off by centimetres, metres.
    direction : (float, float)
        That direction, a unit vector of which the first component is not negative.
    free : bool
        True if the pose itself is one of many along that direction: parallel walls, or a deviation of metres.
    parallel : bool
        True if the reliability of the set is no more than that of parallel walls: see `kernels.reliability`.
    leverages : (k,) of `LEVERAGE`
        The pose as it would be without each of its walls.
    views : EstimatedViews or None
        The estimated poses of the scan's views, if they are not exact.
    """

    pose: RigidTransform
    covariance: Floats
    wall_sigma: float
    weakest: float
    direction: tuple[float, float]
    free: bool
    parallel: bool
    leverages: Records
    views: EstimatedViews | None = None

    @classmethod
    def of(cls, numbers: Any, leverages: Records) -> EstimatedPose:
        """Return the pose of a record of `ESTIMATED`, given as a tuple."""
        (theta, x, y, xx, xy, xt, yy, yt, tt), variance, weakest, dx, dy, parallel = numbers
        sign = -1.0 if dx < 0.0 or (dx == 0.0 and dy < 0.0) else 1.0
        spread = 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)
        return cls(
            pose=RigidTransform(x, y, theta),
            covariance=np.array((xx, xy, xt, xy, yy, yt, xt, yt, tt)).reshape(3, 3),
            wall_sigma=math.sqrt(variance),
            weakest=weakest,
            direction=(sign * dx, sign * dy),
            free=bool(parallel) or spread > ONE_OF_MANY**2,
            parallel=bool(parallel),
            leverages=leverages,
        )

    @property
    def degenerate(self) -> bool:
        """Return whether a direction of the position is not fixed: parallel walls, or a deviation beyond 0.5 m."""
        return self.parallel or self.weakest > MAX_DEVIATION


def estimate_poses(
    context: SearchContext, sets: Sequence[ConsensusSet], *, leverages: bool = False
) -> list[EstimatedPose]:
    """Estimate the poses of consensus sets, of one at least; with the `leverages` of the walls of the first.

    After the deadline only some poses are estimated and returned, the first one at least, and the leverages are those
    of some of the walls.
    """
    every = slices_between_looks(context, len(sets))
    found, without = _estimated(context, sets[next(every)], leverages=leverages)
    estimated = list(map(EstimatedPose.of, found.tolist(), chain([without], repeat(NO_LEVERAGES))))
    for some in every:
        estimated += [EstimatedPose.of(one, NO_LEVERAGES) for one in _estimated(context, sets[some])[0].tolist()]
    views = context.scan.views
    if views is None or not views.uncertain:
        return estimated
    solved: list[EstimatedPose] = []
    for one, alone in zip(sets, estimated, strict=False):
        if solved and context.deadline.passed:
            break
        solved.append(_with_views(context, one, views, alone))
    return solved


def slices_between_looks(context: SearchContext, count: int) -> Iterator[slice]:
    """Yield the slices of some poses that are estimated between two looks at the deadline, until it passes."""
    step = _at_once(context)
    for begin in range(0, max(1, count), step):
        if begin > 0 and context.deadline.passed:
            break
        yield slice(begin, begin + step)


def _at_once(context: SearchContext) -> int:
    """Return how many poses are estimated, or walls left out of one, between two looks at the deadline."""
    return max(1, ESTIMATED_AT_ONCE // max(1, len(context.lines.rows)) ** 2)


def _estimated(
    context: SearchContext, sets: Sequence[ConsensusSet], *, leverages: bool = False
) -> tuple[Records, Records]:
    """Return the poses of consensus sets, (k,) of `ESTIMATED`, and the leverages of the first, (m,) of `LEVERAGE`."""
    found = np.zeros(len(sets), ESTIMATED)
    lines = len(context.lines.rows)
    # Each wall that is left out takes as long as the lines are many.
    room = min(lines, max(1, ESTIMATED_AT_ONCE // max(1, lines))) if leverages else 0
    without = np.zeros(lines if leverages else 0, LEVERAGE)
    question, walls, work = context.question_of_a_pose, context.known_walls, context.workspace
    matches, starts = matches_of(sets), poses_of(sets)
    count = kernels.estimate_poses(question, walls, matches, starts, found, 0, without[:room], work)
    done = min(room, count)
    while leverages and done < count and not context.deadline.passed:
        some = without[done : done + room]
        kernels.estimate_poses(question, walls, matches[:1], starts[:1], found[:1], done, some, work)
        done = min(done + room, count)
    return found, without[:done]


def _with_views(context: SearchContext, best: ConsensusSet, views: Views, alone: EstimatedPose) -> EstimatedPose:
    """Estimate the errors of the views together with the pose.

    Without one of its walls the pose cannot be known better than with it.
    """
    on = best.matches["wall"][context.lines.sightings["row"]]
    seen, on = context.lines.sightings[on >= 0], on[on >= 0]
    if not len(seen):
        return alone
    lines, sigma = context.index.walls.rows[on], context.index.sigma
    lines["offset"] += best.matches["shift"][seen["row"]]
    shown = SeenOnWalls.of(views, seen, lines, on)
    found = shown.estimate(alone.pose, None if sigma is None else max(sigma**2, LEAST_KNOWN_VARIANCE), context.deadline)
    loose = shown.covariance_with(found, max(found.wall_variance, COMMON_WALL_ERROR**2))
    values, vectors = np.linalg.eigh(loose[:2, :2])
    dx, dy = vectors[:, 1].tolist()
    sign = -1.0 if dx < 0.0 or (dx == 0.0 and dy < 0.0) else 1.0
    weakest = math.sqrt(max(0.0, float(values[1])))
    leverages = alone.leverages.copy()
    leverages["deviation"] = np.maximum(leverages["deviation"], weakest)
    return replace(
        alone,
        pose=found.pose,
        covariance=found.covariance,
        wall_sigma=math.sqrt(found.wall_variance),
        weakest=weakest,
        direction=(sign * dx, sign * dy),
        free=alone.parallel or float(np.linalg.eigvalsh(found.covariance[:2, :2])[1]) > ONE_OF_MANY**2,
        leverages=leverages,
        views=found,
    )
