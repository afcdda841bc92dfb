"""The one estimator: pose, walls' errors, common offset, strain of the map, rotation of the sensor, steps of views.

All are unknowns of one Gaussian model. The residual of a point m of the scan, seen at time tau from the sensor's place
o, on a wall of normal n and offset p, is

    r = n . (z + b u + g) - p - e      z = (I + S) R(theta) R(omega tau) (m - o),      u = z / |z|

with the sensor's place g on the map, the error e of the wall, an offset b along the ray, a symmetric strain S of the
map around the sensor, and the angle omega by which the sensor turned during the scan. All but g and theta have priors.
A line enters by its centroid and by its direction. The errors of walls are eliminated. The sensor's place is the
centre of all of it, so that the origin of the scan frame does not matter.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from registration import RigidTransform
from registration.kernels import MAX_DEVIATION
from registration.layout import Floats

from ..context import SearchContext
from ..tables import Model
from ..tuning import DOUBTING_DEVIATIONS, LEAST_TURN
from .consensus_set import ConsensusSet
from .kernels.estimation import COLUMNS, OFFSET, STRAIN, TURN, leave_out_walls, solve_model, weakest
from .observations import Indices, Observations, observations_of
from .tuning import (
    COMMON_WALL_ERROR,
    FREE_DEVIATION,
    LEAST_KNOWN_VARIANCE,
    OFFSET_DEVIATION,
    ONE_OF_MANY,
    SCALE_DEVIATION,
    SHOWN_CHI_SQUARE,
    SPRING,
    STRAIN_DEVIATION,
    TURN_DEVIATION,
    USUAL_SWEEP,
    USUAL_WALL_ERROR,
)

STRAINS = slice(STRAIN, STRAIN + 3)


def _prior(known: float | None, turn: float) -> Floats:
    """Return the information on the columns before anything is seen, (5, 5), by the known variance of walls.

    The scale may differ more than the shape: that of the laser's ranges counts, too. A map of which the walls are known
    better is strained less.
    """
    strain = STRAIN_DEVIATION * (1.0 if known is None else min(1.0, math.sqrt(known) / USUAL_WALL_ERROR))
    # Across half as much: so it is the same along any axes.
    out = np.diag(np.array([OFFSET_DEVIATION, strain, strain, strain / math.sqrt(2.0), turn]) ** -2.0)
    scale, shape = 0.25 * SCALE_DEVIATION**-2.0, 0.5 * strain**-2.0
    out[1:3, 1:3] = [[scale + shape, scale - shape], [scale - shape, scale + shape]]
    return out


@dataclass(frozen=True, slots=True)
class Leverages:
    """The pose without each of the walls, (m,) each, at the sensor's place.

    Attributes
    ----------
    walls : int
    own : float64
        Degree to which a wall counts as one of its own, next to those that it is tied to, 0 to 1.
    displacements : float64
        By how much the place would move, metres.
    deviations : float64
        Its standard deviation along its weakest direction then, metres.
    directions : (m, 2)
        Of the move, or the weakest one if that is not fixed.
    """

    walls: Indices
    own: Floats
    displacements: Floats
    deviations: Floats
    directions: Floats


@dataclass(frozen=True, slots=True)
class Estimate:
    """A pose with its covariance, and what it was estimated together with.

    Attributes
    ----------
    pose : RigidTransform
        Index frame from scan frame.
    covariance : (3, 3) float64
        Of additive (x, y, theta).
    wall_sigma : float
        Standard deviation of the walls' own errors, as known or as their residuals show it, metres.
    weakest : float
        If walls were off by centimetres, the deviation of the sensor's place along its weakest direction, metres.
    direction : (float, float)
        That direction, a unit vector of which the first component is not negative.
    free : bool
        True where a fit along that direction says less than the middle of the walls.
    leverages : Leverages
    with_columns : bool
        True if the pose was estimated together with the following; else they are not shown.
    offset, strain, turn : (value, deviation)
        Offset of the walls along the rays, metres, positive where walls are farther than measured; strain xx, yy, xy;
        angle by which the sensor turned during the scan, radians.
    found, spread : float64
        Errors of the views, (u,), and their covariance; of length 0 where they are exact.
    """

    pose: RigidTransform
    covariance: Floats
    wall_sigma: float
    weakest: float
    direction: tuple[float, float]
    free: bool
    leverages: Leverages
    with_columns: bool
    offset: tuple[float, float]
    strain: tuple[Floats, Floats]
    turn: tuple[float, float]
    found: Floats
    spread: Floats

    @property
    def degenerate(self) -> bool:
        """Return whether a direction of the position is not fixed: its deviation exceeds 0.5 m."""
        return self.weakest > MAX_DEVIATION


def estimate(context: SearchContext, best: ConsensusSet, *, scaled: bool, turned: bool) -> Estimate | None:
    """Estimate the pose of a consensus set; None where it has no pairs.

    1. Solve for all unknowns by Gauss-Newton; the variance of walls' errors is what their residuals show, unless it is
       known.
    2. Solve without the columns if together they do not differ from 0, the scan was not corrected, and its sensor is
       taken to be at rest: always on, they widen the deviations on exact maps by a third. Where only the
       rotation is in doubt, solve without the column of the rotation.
    3. Leave out each wall in turn.
    """
    seen = observations_of(context, best.matches)
    if seen is None:
        return None
    declared = context.index.sigma
    known = None if declared is None else max(declared**2, LEAST_KNOWN_VARIANCE)
    columns = _columns(context, seen)
    turn = TURN_DEVIATION * (context.scan.sweep_s or USUAL_SWEEP)
    full = _Solution(seen, known, best.pose, columns, turn)
    if not len(columns):
        return full.estimate(full, shown=False)
    turned = turned or seen.views is not None or full.turns
    shown = scaled or turned or full.differs > SHOWN_CHI_SQUARE[len(columns)]
    kept = columns[columns != TURN] if shown and not turned else columns[: shown * len(columns)]
    alone = full if len(kept) == len(columns) else _Solution(seen, known, best.pose, kept, turn)
    return alone.estimate(full, shown=shown)


def _columns(context: SearchContext, seen: Observations) -> Indices:
    """Return the columns beyond the pose that a scan may show."""
    if (seen.views is not None and not seen.timed) or context.options.estimator != "joint":
        return np.zeros(0, np.intp)
    first = OFFSET if context.scan.viewpoint is not None else STRAIN  # no rays, no offset along them
    return np.arange(first, COLUMNS if seen.timed else TURN)


class _Solution:
    """The solution of the model for some columns beyond the pose."""

    def __init__(
        self, seen: Observations, known: float | None, start: RigidTransform, columns: Indices, turn: float
    ) -> None:
        self.seen, self.known, views = seen, known, seen.views
        root = np.zeros((3, 0)) if views is None else views.root
        began = np.zeros(0) if views is None else views.found
        places = np.zeros((1, 2)) if views is None else np.array([(pose.x, pose.y) for pose in views.poses])
        active = np.concatenate([np.arange(3), columns, np.arange(COLUMNS, COLUMNS + len(began))])
        self.active, self.views, k = active, len(began), len(active)
        information = np.eye(k)
        information[:3, :3] *= SPRING  # it holds the pose, weakly
        own = slice(3, 3 + len(columns))
        information[own, own] = _prior(known, turn)[columns[:, None] - 3, columns - 3]
        self.model = Model(seen.lines, seen.ties, seen.own, seen.sensor, places, root, began, active, information)
        at = start.apply(seen.sensor)
        self.x = np.concatenate([at, [start.theta], np.zeros(COLUMNS - 3), began])
        self.covariance = np.empty((k, k))
        self.variance, self.differs = solve_model(self.model, self.x, self.covariance, -1.0 if known is None else known)

    @property
    def deviations(self) -> Floats:
        """The standard deviation of each unknown, 0 of those that are not solved for."""
        out = np.zeros(len(self.x))
        out[self.active] = np.sqrt(np.maximum(0.0, np.diag(self.covariance)))
        return out

    @property
    def turns(self) -> bool:
        """Return whether the sensor turned beyond doubt."""
        return bool(abs(self.x[TURN]) > max(LEAST_TURN, DOUBTING_DEVIATIONS * self.deviations[TURN]))

    def estimate(self, full: _Solution, *, shown: bool) -> Estimate:
        """Return it in the frame of the scan's origin, with the columns of the full one."""
        x, seen, k = self.x, self.seen, len(self.active)
        covariances, places = np.empty((2, k, k)), np.empty((len(seen.walls), 5))
        loose = max(self.variance, COMMON_WALL_ERROR**2)
        leave_out_walls(self.model, x, self.variance, loose, covariances, places)
        self.covariance = covariances[0]
        unsure, dx, dy = weakest(covariances[1])
        moves, deviations = places[:, :2], places[:, 2]
        if self.views:
            deviations = np.maximum(deviations, unsure)
        displacements = np.minimum(np.hypot(*moves.T), FREE_DEVIATION)
        moved = (displacements > deviations)[:, None]
        directions = np.where(moved, moves / np.maximum(displacements, 1e-12)[:, None], places[:, 3:])
        c, s = math.cos(x[2]), math.sin(x[2])
        ox, oy = c * seen.sensor[0] - s * seen.sensor[1], s * seen.sensor[0] + c * seen.sensor[1]
        lever = np.array([[1.0, 0.0, oy], [0.0, 1.0, -ox], [0.0, 0.0, 1.0]])
        errors, every = slice(k - self.views, k), full.deviations
        return Estimate(
            pose=RigidTransform(float(x[0] - ox), float(x[1] - oy), float(x[2])),
            covariance=lever @ self.covariance[:3, :3] @ lever.T,
            wall_sigma=math.sqrt(self.variance),
            weakest=unsure,
            direction=(dx, dy),
            free=weakest(self.covariance)[0] > ONE_OF_MANY,
            leverages=Leverages(seen.walls, seen.own, displacements, deviations, directions),
            with_columns=shown,
            offset=(float(full.x[OFFSET]), float(every[OFFSET])),
            strain=(full.x[STRAINS], every[STRAINS]),
            turn=(float(full.x[TURN]), float(every[TURN])),
            found=x[COLUMNS:],
            spread=self.covariance[errors, errors],
        )
