"""The answer worked out: its pose with the error of the map's walls, and what it would be without each of them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain, repeat
from typing import Any

import numpy as np

from registration import RigidTransform
from registration.layout import Floats, Records
from registration.observability import MAX_DEVIATION
from registration.values import value

from ..context import SearchContext
from ..layout import HINGE, SETTLED
from ..scan.scan import Views
from ..tuning import COMMON_WALL_ERROR, LEAST_KNOWN_VARIANCE, ONE_OF_MANY, SETTLED_AT_ONCE
from .kernels import settling as kernels
from .ranking import Ranked, matches_of, poses_of
from .view_settling import SeenOnWalls, ViewsSettled

NO_HINGES = np.zeros(0, HINGE)

_settle = kernels.settle


@value(frozen=True, slots=True)
class Settled:
    """A pose that reckons with walls that are off, as far as their residuals show it.

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
        Whether the pose itself is one of many along that direction: parallel walls, or a deviation of metres.
    parallel : bool
        Whether all walls are parallel within three standard deviations of their angles.
    hinges : (k,) of `HINGE`
        What the pose would be without each of its walls.
    views : ViewsSettled or None
        Where the scan's views were, if they are not exact.
    """

    pose: RigidTransform
    covariance: Floats
    wall_sigma: float
    weakest: float
    direction: tuple[float, float]
    free: bool
    parallel: bool
    hinges: Records
    views: ViewsSettled | None = None

    @classmethod
    def of(cls, numbers: Any, hinges: Records) -> Settled:
        """Return what a record of `SETTLED`, as a tuple, says."""
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
            hinges=hinges,
        )

    @property
    def degenerate(self) -> bool:
        """Whether a direction of the position is not fixed: parallel walls, or a deviation beyond 0.5 m."""
        return self.parallel or self.weakest > MAX_DEVIATION


def settle(context: SearchContext, explanations: Sequence[Ranked], *, hinges: bool = False) -> list[Settled]:
    """Work out the poses of consensus sets, of one at least; with `hinges` of the first, where the others have none.

    After the deadline no more than some are, the first one at least, and returned; and the hinges are those of some of
    the walls.
    """
    every = slices_between_looks(context, len(explanations))
    found, without = _settled(context, explanations[next(every)], hinges=hinges)
    settled = list(map(Settled.of, found.tolist(), chain([without], repeat(NO_HINGES))))
    for some in every:
        settled += [Settled.of(one, NO_HINGES) for one in _settled(context, explanations[some])[0].tolist()]
    views = context.scan.views
    if views is None or not views.uncertain:
        return settled
    solved: list[Settled] = []
    for one, alone in zip(explanations, settled, strict=False):
        if solved and context.deadline.passed:
            break
        solved.append(_with_views(context, one, views, alone))
    return solved


def slices_between_looks(context: SearchContext, count: int) -> Iterator[slice]:
    """Yield the slices of some poses that are settled between two looks at the deadline, until it passes."""
    step = _at_once(context)
    for begin in range(0, max(1, count), step):
        if begin > 0 and context.deadline.passed:
            break
        yield slice(begin, begin + step)


def _at_once(context: SearchContext) -> int:
    """Return how many poses are settled, or walls left out of one, between two looks at the deadline."""
    return max(1, SETTLED_AT_ONCE // max(1, len(context.lines.rows)) ** 2)


def _settled(
    context: SearchContext, explanations: Sequence[Ranked], *, hinges: bool = False
) -> tuple[Records, Records]:
    """Return the poses of some consensus sets, (k,) of `SETTLED`, and the hinges of the first as far as wanted."""
    found = np.zeros(len(explanations), SETTLED)
    lines = len(context.lines.rows)
    # Each wall that is left out takes as long as the lines are many.
    room = min(lines, max(1, SETTLED_AT_ONCE // max(1, lines))) if hinges else 0
    without = np.zeros(lines if hinges else 0, HINGE)
    question, walls, work = context.question_of_a_pose, context.known_walls, context.workspace
    matches, starts = matches_of(explanations), poses_of(explanations)
    count = _settle(question, walls, matches, starts, found, 0, without[:room], work)
    done = min(room, count)
    while hinges and done < count and not context.deadline.passed:
        some = without[done : done + room]
        _settle(question, walls, matches[:1], starts[:1], found[:1], done, some, work)
        done = min(done + room, count)
    return found, without[:done]


def _with_views(context: SearchContext, best: Ranked, views: Views, alone: Settled) -> Settled:
    """Solve again for the errors of the views beside the pose.

    Without one of its walls the pose cannot be known better than with it.
    """
    on = best.matches["wall"][context.lines.sightings["row"]]
    seen, on = context.lines.sightings[on >= 0], on[on >= 0]
    if not len(seen):
        return alone
    lines, sigma = context.index.walls.rows[on], context.index.sigma
    lines["offset"] += best.matches["shift"][seen["row"]]
    shown = SeenOnWalls.of(views, seen, lines, on)
    found = shown.settle(alone.pose, None if sigma is None else max(sigma**2, LEAST_KNOWN_VARIANCE), context.deadline)
    loose = shown.covariance_with(found, max(found.wall_variance, COMMON_WALL_ERROR**2))
    values, vectors = np.linalg.eigh(loose[:2, :2])
    dx, dy = vectors[:, 1].tolist()
    sign = -1.0 if dx < 0.0 or (dx == 0.0 and dy < 0.0) else 1.0
    weakest = math.sqrt(max(0.0, float(values[1])))
    hinges = alone.hinges.copy()
    hinges["deviation"] = np.maximum(hinges["deviation"], weakest)
    return replace(
        alone,
        pose=found.pose,
        covariance=found.covariance,
        wall_sigma=math.sqrt(found.wall_variance),
        weakest=weakest,
        direction=(sign * dx, sign * dy),
        free=alone.parallel or float(np.linalg.eigvalsh(found.covariance[:2, :2])[1]) > ONE_OF_MANY**2,
        hinges=hinges,
        views=found,
    )
