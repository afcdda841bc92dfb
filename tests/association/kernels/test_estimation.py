"""The estimator's kernels against dense matrices: least squares with the errors of walls as unknowns."""

from __future__ import annotations

import numpy as np
from hypothesis import given

from association.consensus.kernels.estimation import COLUMNS, leave_out_walls, linearize, solve_model
from association.consensus.tuning import ROUGH_FRACTION
from association.layout import OBSERVATION
from association.tables import Model
from registration.layout import Floats

from .reference import SEEDS

VARIANCE = 0.02**2


def drawn(rng: np.random.Generator, views: int) -> Model:
    """Return lines of some views on walls of all directions, of which the first two are tied, and not quite on them."""
    n, m, u = 12, 6, 3 * (views - 1)
    seen = np.zeros(n, OBSERVATION)
    angles, turn = rng.uniform(-np.pi, np.pi, n), rng.normal(0.0, 0.01)
    seen["dx"], seen["dy"] = np.cos(angles), np.sin(angles)
    seen["centroid_x"], seen["centroid_y"] = rng.uniform(-8.0, 8.0, (2, n))
    seen["normal_x"], seen["normal_y"] = -np.sin(angles + turn), np.cos(angles + turn)
    seen["offset"] = seen["normal_x"] * seen["centroid_x"] + seen["normal_y"] * seen["centroid_y"]
    seen["offset"] += rng.normal(0.0, 0.03, n)
    seen["spread"], seen["variance"] = rng.uniform(0.1, 2.0, n), rng.uniform(1e-6, 1e-4, n)
    seen["wall"], seen["of_view"] = np.arange(n) % m, np.arange(n) % views
    seen["time"], seen["pace"] = rng.uniform(-0.5, 0.5, n), rng.normal(0.0, 0.05, n)
    ties = np.array([-1.0, -1.0, -1.0, -1.0, 1.0, 1.4])
    active = np.concatenate([np.arange(3), np.arange(3, COLUMNS), np.arange(COLUMNS, COLUMNS + u)])
    information = np.diag(np.concatenate([np.full(3, 1e-2), rng.uniform(1e2, 1e4, len(active) - 3)]))
    places, root = rng.uniform(-2.0, 2.0, (views, 2)), rng.normal(0.0, 0.02, (3 * views, u))
    return Model(seen, ties, np.ones(m), rng.normal(size=2), places, root, np.zeros(u), active, information)


def rows(model: Model, x: Floats) -> tuple[Floats, Floats]:
    """Return derivatives and residuals of centroids and directions."""
    a, b = np.empty((2, len(model.seen), len(x) + 1))
    linearize(model, x, a, b)
    return a, b


def normal(model: Model, x: Floats) -> tuple[Floats, Floats]:
    """Return the normal matrix and the gradient, by the covariance of all residuals."""
    (a, b), seen, wall = rows(model, x), model.seen, model.seen["wall"]
    weights = 1.0 / (seen["variance"] + ROUGH_FRACTION * VARIANCE)
    tied = (model.ties[:, None] >= 0.0) & (model.ties >= 0.0)
    correlation = np.where(tied, np.exp(-np.abs(model.ties[:, None] - model.ties)), np.eye(len(model.ties)))
    inverse = np.linalg.inv(np.diag(1.0 / weights) + VARIANCE * correlation[np.ix_(wall, wall)])
    along = weights * seen["spread"]
    both = a.T @ inverse @ a + (b.T * along) @ b
    both[:-1, :-1] += model.information
    both[3:-1, -1] += (model.information @ x[model.active])[3:]
    return both[:-1, :-1], both[:-1, -1]


@given(seed=SEEDS)
def test_the_derivatives_are_those_of_the_residuals(seed: int) -> None:
    rng = np.random.default_rng(seed)
    model, step = drawn(rng, 1 + seed % 3), 1e-6
    x = np.zeros(COLUMNS + len(model.began))
    x[:3] = rng.normal(size=3)
    found = rows(model, x)
    for k, change in enumerate(step * np.eye(len(x))):
        for own, more, less in zip(found, rows(model, x + change), rows(model, x - change), strict=True):
            assert np.allclose(own[:, k], (more[:, -1] - less[:, -1]) / (2.0 * step), atol=1e-6)


@given(seed=SEEDS)
def test_the_solution_is_that_of_dense_least_squares(seed: int) -> None:
    model = drawn(np.random.default_rng(seed), 1 + seed % 3)
    x, covariance = np.zeros(COLUMNS + len(model.began)), np.empty((len(model.active), len(model.active)))
    x[:2] = model.sensor
    variance, _ = solve_model(model, x, covariance, VARIANCE)
    assert variance == VARIANCE
    matrix, gradient = normal(model, x)
    assert np.allclose(np.linalg.solve(matrix, gradient), 0.0, atol=1e-4)
    covariances, places = np.empty((2, *covariance.shape)), np.empty((len(model.ties), 5))
    leave_out_walls(model, x, VARIANCE, VARIANCE, covariances, places)
    assert np.allclose(covariances, np.linalg.inv(matrix), rtol=1e-6, atol=1e-12)
