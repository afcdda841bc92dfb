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

from registration import RigidTransform, wrap_angle
from registration.kernels import MAX_DEVIATION
from registration.layout import Floats, Records

from ..context import SearchContext
from .consensus_set import ConsensusSet
from .kernels.linearize import COLUMNS, OFFSET, STRAIN, TURN, linearize
from .observations import Indices, Observations, observations_of
from .tuning import (
    COMMON_WALL_ERROR,
    ESTIMATION_ROUNDS,
    FREE_DEVIATION,
    LEAST_KNOWN_VARIANCE,
    LEAST_WALL_ERROR,
    MAX_STEP,
    MAX_TURN,
    OFFSET_DEVIATION,
    ONE_OF_MANY,
    ROUGH_FRACTION,
    SCALE_DEVIATION,
    SHOWN_CHI_SQUARE,
    SMALL_CHANGE,
    SMALL_STEP,
    SPRING,
    STRAIN_DEVIATION,
    TURN_DEVIATION,
    UNSEEN_ERROR,
    USUAL_WALL_ERROR,
    USUAL_WALLS,
)

STRAINS = slice(STRAIN, STRAIN + 3)
ROUNDING = 1e-13


def _prior(known: float | None) -> Floats:
    """Return the information on the columns before anything is seen, (5, 5), by the known variance of walls.

    The scale may differ more than the shape: that of the laser's ranges counts, too. A map of which the walls are known
    better is strained less.
    """
    strain = STRAIN_DEVIATION * (1.0 if known is None else min(1.0, math.sqrt(known) / USUAL_WALL_ERROR))
    # Across half as much: so it is the same along any axes.
    out = np.diag(np.array([OFFSET_DEVIATION, strain, strain, strain / math.sqrt(2.0), TURN_DEVIATION]) ** -2.0)
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


def estimate(context: SearchContext, best: ConsensusSet, *, scaled: bool = False) -> Estimate | None:
    """Estimate the pose of a consensus set; None where it has no pairs.

    1. Solve for all unknowns by Gauss-Newton; the variance of walls' errors is what their residuals show, unless it is
       known.
    2. If the columns together do not differ from 0, and the scan was not put to scale, solve without them: always on,
       they widen the deviations on exact maps by a third.
    3. Leave out each wall in turn.
    """
    seen = observations_of(context, best.matches)
    if seen is None:
        return None
    declared = context.index.sigma
    known = None if declared is None else max(declared**2, LEAST_KNOWN_VARIANCE)
    columns = _columns(context, seen)
    if len(columns):
        model = _Model(seen, known, best.pose, columns)
        model.solve()
        if scaled or model.shows_columns():
            return model.estimate(model, shown=True)
    plain = _Model(seen, known, best.pose, columns[:0])
    plain.solve()
    return plain.estimate(model if len(columns) else plain, shown=False)


def _columns(context: SearchContext, seen: Observations) -> Indices:
    """Return the columns beyond the pose that a scan may show."""
    if seen.views is not None or context.options.estimator != "joint":
        return np.zeros(0, np.intp)
    first = OFFSET if context.scan.viewpoint is not None else STRAIN  # no rays, no offset along them
    return np.arange(first, COLUMNS if seen.timed else TURN)


class _Model:
    """The normal equations of some unknowns, and their solution."""

    def __init__(self, seen: Observations, known: float | None, start: RigidTransform, columns: Indices) -> None:
        self.seen, self.known, self.start = seen, known, start
        self.root = np.zeros((0, 0)) if seen.views is None else seen.views.root
        self.started = np.zeros(0) if seen.views is None else seen.views.found
        self.size = COLUMNS + self.root.shape[1]
        self.active = np.concatenate([np.arange(3), columns, np.arange(COLUMNS, self.size)]).astype(np.intp)
        self.taken = np.append(self.active, self.size)  # with the residuals
        self.columns = np.arange(3, 3 + len(columns))  # their places among the active ones
        self.information = self._prior_information()
        at = start.apply(seen.sensor[None])[0]
        self.begin = np.concatenate([at, [start.theta], np.zeros(COLUMNS - 3), self.started])
        self.x, self.variance = self.begin.copy(), USUAL_WALL_ERROR**2 if known is None else known
        self.covariance = np.zeros((len(self.active), len(self.active)))
        self.walls, self.own = self._wall_prior(), _own(seen.ties)
        self.of_wall = np.zeros((len(seen.walls), len(seen)))
        self.of_wall[seen.wall, np.arange(len(seen))] = 1.0

    @property
    def deviations(self) -> Floats:
        """The standard deviation of each unknown, 0 of those that are not solved for."""
        out = np.zeros(self.size)
        out[self.active] = np.sqrt(np.maximum(0.0, np.diag(self.covariance)))
        return out

    def _wall_prior(self) -> Floats:
        """Return the information of walls' errors of variance 1, (m, m): correlated along chains by their ties."""
        ties, m = self.seen.ties, len(self.seen.ties)
        out = np.eye(m)
        if not (ties >= 0.0).any():
            return out
        r = np.zeros(m)
        r[1:] = np.where((ties[1:] >= 0.0) & (ties[:-1] >= 0.0), np.exp(np.minimum(0.0, ties[:-1] - ties[1:])), 0.0)
        r = np.minimum(r, 1.0 - 1e-9)
        free = 1.0 / (1.0 - r[1:] ** 2)
        at = np.arange(m - 1)
        out[at + 1, at + 1] += r[1:] ** 2 * free
        out[at, at] += r[1:] ** 2 * free
        out[at, at + 1] = out[at + 1, at] = -r[1:] * free
        return out

    def solve(self) -> None:
        """Take the steps of Gauss-Newton, until they are small."""
        for _ in range(ESTIMATION_ROUNDS):
            normal, gradient, by_wall = self._normal(self.variance)
            self.covariance = _inverse(normal)
            step, before = -self.covariance @ gradient, self.variance
            self.x[self.active] += step
            if self.known is None:
                self.variance = self._shown_variance(by_wall, step)
            if np.abs(step).max() < SMALL_STEP and abs(self.variance - before) < SMALL_CHANGE * before:
                break
        away = math.hypot(*(self.x[:2] - self.begin[:2])) > MAX_STEP
        if away or abs(wrap_angle(self.x[2] - self.begin[2])) > MAX_TURN or not np.isfinite(self.x).all():
            self.x, self.variance = self.begin.copy(), USUAL_WALL_ERROR**2 if self.known is None else self.known
            self.covariance = _inverse(self._normal(self.variance)[0])

    def shows_columns(self) -> bool:
        """Return whether the columns differ from 0 together, by a chi-square test, as the residuals scatter."""
        own = slice(3, 3 + len(self.columns))
        x = self.x[self.active[own]]
        differs = float(x @ np.linalg.solve(self.covariance[own, own], x))
        return differs > SHOWN_CHI_SQUARE[len(x)] * max(1.0, self._scatter())

    def _scatter(self) -> float:
        """Return how much more the residuals scatter than their variances say: chi-square per degree of freedom."""
        (a, b), weights, angular = self._weighted(self.variance)
        residuals, slopes = a[:, -1], b[:, -1]
        left = self.of_wall @ (weights * residuals)
        information = self.walls / self.variance + np.diag(self.of_wall @ weights)
        chi_square = weights @ residuals**2 + angular @ slopes**2 - left @ np.linalg.solve(information, left)
        return max(0.0, float(chi_square)) / max(1, 2 * len(residuals) - len(self.active))

    def _rows(self) -> tuple[Floats, Floats]:
        """Return the derivatives of centroids and directions by the active unknowns, and the residuals, (n, k + 1)."""
        seen = self.seen
        a, b = np.empty((2, len(seen), COLUMNS + 1))
        if seen.views is None:
            linearize(seen.lines, seen.sensor, self.x, a, b)
            return a[:, self.taken], b[:, self.taken]
        lines, levers, turns = self._by_views()
        linearize(lines, seen.sensor, self.x, a, b)
        by_view = self.root.reshape(len(seen.views), 3, -1)[seen.view]
        a = np.hstack([a[:, :-1], np.einsum("ni,nij->nj", levers, by_view), a[:, -1:]])
        b = np.hstack([b[:, :-1], turns[:, None] * by_view[:, 2], b[:, -1:]])
        return a[:, self.taken], b[:, self.taken]

    def _by_views(self) -> tuple[Records, Floats, Floats]:
        """Return the lines with the views where they are found, and their derivatives by a step of the view."""
        seen = self.seen
        assert seen.views is not None
        shifts = (self.root @ (self.x[COLUMNS:] - self.started)).reshape(-1, 3)[seen.view]
        origins = np.array([(pose.x, pose.y) for pose in seen.views.poses])[seen.view]
        lines = seen.lines.copy()
        c, s = np.cos(shifts[:, 2]), np.sin(shifts[:, 2])
        x, y = lines["centroid_x"] - origins[:, 0], lines["centroid_y"] - origins[:, 1]
        x, y = c * x - s * y, s * x + c * y
        lines["centroid_x"], lines["centroid_y"] = origins[:, 0] + shifts[:, 0] + x, origins[:, 1] + shifts[:, 1] + y
        lines["dx"], lines["dy"] = (
            c * lines["dx"] - s * lines["dy"],
            s * lines["dx"] + c * lines["dy"],
        )
        cosine, sine = math.cos(self.x[2]), math.sin(self.x[2])
        nx = cosine * lines["normal_x"] + sine * lines["normal_y"]
        ny = cosine * lines["normal_y"] - sine * lines["normal_x"]
        levers = np.stack([nx, ny, ny * x - nx * y], axis=1)
        return lines, levers, ny * lines["dx"] - nx * lines["dy"]

    def _weighted(self, variance: float) -> tuple[tuple[Floats, Floats], Floats, Floats]:
        weights = 1.0 / (self.seen.variances + ROUGH_FRACTION * variance)
        return self._rows(), weights, weights * self.seen.spreads

    def _normal(self, variance: float) -> tuple[Floats, Floats, Floats]:
        """Return the normal matrix, the gradient, and by wall the sums of weights, rows and residuals, (m, k + 2)."""
        (a, b), weights, angular = self._weighted(variance)
        both = (a.T * weights) @ a + (b.T * angular) @ b
        by_wall = (self.of_wall * weights) @ np.column_stack([np.ones(len(a)), a])
        if variance > LEAST_KNOWN_VARIANCE:
            information = self.walls / variance
            information[np.diag_indices(len(information))] += by_wall[:, 0]
            both -= by_wall[:, 1:].T @ np.linalg.solve(information, by_wall[:, 1:])
        normal, gradient = both[:-1, :-1], both[:-1, -1]
        normal += self.information
        gradient[3:] += self.information[3:, 3:] @ self.x[self.active[3:]]
        return normal, gradient, by_wall

    def _prior_information(self) -> Floats:
        """Return the information on the active unknowns before anything is seen; a weak spring holds the pose."""
        out = np.eye(len(self.active))
        out[:3, :3] *= SPRING
        at = self.active[self.columns] - 3
        out[np.ix_(self.columns, self.columns)] = _prior(self.known)[np.ix_(at, at)]
        return out

    def _shown_variance(self, by_wall: Floats, step: Floats) -> float:
        """Return the variance of the walls' own errors that their residuals show, shrunk where walls are few.

        After a step. An estimate from few walls is uncertain itself: Student's t has that much more variance. And walls
        that are farthest off match nothing.
        """
        weights = by_wall[:, 0]
        rows = by_wall[:, 1:-1] / weights[:, None]
        means = by_wall[:, -1] / weights + rows @ step
        spreads = ((rows @ self.covariance) * rows).sum(axis=1)
        free = np.maximum(0.0, 1.0 - spreads / (self.variance + 1.0 / weights))
        found = USUAL_WALLS * USUAL_WALL_ERROR**2 + float(self.own @ (means**2 - free / weights))
        count = USUAL_WALLS + float(self.own @ free)
        return UNSEEN_ERROR * (1.0 + 2.0 / max(1.0, count - 2.0)) * max(found / count, LEAST_WALL_ERROR**2)

    def estimate(self, full: _Model, *, shown: bool) -> Estimate:
        """Return the solution in the frame of the scan's origin, with the columns of the full one."""
        self.covariance = _inverse(self._normal(self.variance)[0])
        x, seen = self.x, self.seen
        c, s = math.cos(x[2]), math.sin(x[2])
        ox, oy = c * seen.sensor[0] - s * seen.sensor[1], s * seen.sensor[0] + c * seen.sensor[1]
        lever = np.eye(3)
        lever[:2, 2] = oy, -ox
        covariance = lever @ self.covariance[:3, :3] @ lever.T
        loose = _inverse(self._normal(max(self.variance, COMMON_WALL_ERROR**2))[0])
        weakest, direction = _weakest(loose[:2, :2])
        spread = math.sqrt(float(np.linalg.eigvalsh(self.covariance[:2, :2])[1]))
        views = slice(len(self.active) - self.root.shape[1], None)
        return Estimate(
            pose=RigidTransform(float(x[0] - ox), float(x[1] - oy), float(x[2])),
            covariance=0.5 * (covariance + covariance.T),
            wall_sigma=math.sqrt(self.variance),
            weakest=weakest,
            direction=direction,
            free=spread > ONE_OF_MANY,
            leverages=self._leverages(weakest),
            with_columns=shown,
            offset=(float(full.x[OFFSET]), float(full.deviations[OFFSET])),
            strain=(full.x[STRAINS].copy(), full.deviations[STRAINS]),
            turn=(float(full.x[TURN]), float(full.deviations[TURN])),
            found=x[COLUMNS:].copy(),
            spread=self.covariance[views, views].copy(),
        )

    def _leverages(self, weakest: float) -> Leverages:
        """Return what the solution would be without each wall, and the walls tied to it as far as they are one."""
        seen, m = self.seen, len(self.seen.walls)
        (a, b), weights, angular = self._weighted(self.variance)
        p = len(self.active) - self.root.shape[1]
        residuals, slopes, a, b = a[:, -1], b[:, -1], a[:, :p], b[:, :p]
        of_wall = self.of_wall @ weights
        by_wall, left = (self.of_wall * weights) @ a, self.of_wall @ (weights * residuals)
        squares = (weights[:, None] * a)[:, :, None] * a[:, None, :]
        squares += (angular[:, None] * b)[:, :, None] * b[:, None, :]
        parts = (self.of_wall @ squares.reshape(len(a), -1)).reshape(m, p, p)
        gradients = self.of_wall @ ((weights * residuals)[:, None] * a + (angular * slopes)[:, None] * b)
        known = 1.0 / (of_wall + 1.0 / self.variance)
        parts -= known[:, None, None] * by_wall[:, :, None] * by_wall[:, None, :]
        gradients -= (known * left)[:, None] * by_wall
        ties = seen.ties
        tied = (ties[:, None] >= 0.0) & (ties >= 0.0)
        correlation = np.where(tied, np.exp(-np.abs(ties[:, None] - ties)), np.eye(m))
        kept = np.vstack([1.0 - correlation**2, np.ones(m)])
        normal, gradient = np.einsum("kw,wij->kij", kept, parts), kept @ gradients
        gradient[:, 3:] += self.information[3:p, 3:p] @ self.x[self.active[3:p]]
        covariances = np.linalg.inv(normal + self.information[:p, :p])
        steps = -np.einsum("kij,kj->ki", covariances, gradient)
        moves = steps[:-1, :2] - steps[-1, :2]
        displacements = np.minimum(np.hypot(*moves.T), FREE_DEVIATION)
        values, vectors = np.linalg.eigh(covariances[:-1, :2, :2])
        deviations = np.minimum(np.sqrt(np.maximum(0.0, values[:, 1])), FREE_DEVIATION)
        if len(self.root):
            deviations = np.maximum(deviations, weakest)
        moved = displacements > deviations
        directions = np.where(moved[:, None], moves / np.maximum(displacements, 1e-12)[:, None], vectors[:, :, 1])
        return Leverages(seen.walls, self.own, displacements, deviations, directions)


def _own(ties: Floats) -> Floats:
    """Return how far each wall, in the order of ties, is one of its own next to the one before it, 0 to 1."""
    apart = np.full(len(ties), np.inf)
    apart[1:] = np.where((ties[1:] >= 0.0) & (ties[:-1] >= 0.0), ties[1:] - ties[:-1], np.inf)
    return np.asarray(1.0 - np.exp(-2.0 * apart))


def _inverse(normal: Floats) -> Floats:
    """Return the inverse of a normal matrix, scaled to a unit diagonal, for its units are unlike."""
    scale = 1.0 / np.sqrt(np.maximum(np.diag(normal), 1e-300))
    inverse = np.linalg.inv(normal * scale[:, None] * scale + ROUNDING * np.eye(len(normal)))
    return np.asarray(inverse * scale[:, None] * scale)


def _weakest(covariance: Floats) -> tuple[float, tuple[float, float]]:
    """Return the deviation along the weakest direction, and that direction, pointing right or straight up."""
    values, vectors = np.linalg.eigh(covariance)
    dx, dy = vectors[:, 1].tolist()
    sign = -1.0 if dx < 0.0 or (dx == 0.0 and dy < 0.0) else 1.0
    return math.sqrt(max(0.0, float(values[1]))), (sign * dx, sign * dy)
