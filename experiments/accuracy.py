"""Error, ambiguity, the gain of weighting and their correlation: what Fig. 6 and Tabs. 1 and 2 are made of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .trials import Trials

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Means:
    """Mean squared errors and mean ambiguities of one estimator under one condition.

    Attributes
    ----------
    D_t, D_alpha : float
        Mean square of the distance from the true position, units^2, and of the angle from the true heading, rad^2.
    A_t, A_alpha : float
        Mean ambiguity over the sum of the weights, units^2 and rad^2.
    """

    D_t: float
    D_alpha: float
    A_t: float
    A_alpha: float


def means(trials: Trials, estimator: str) -> Means:
    """Average over all scans of all poses."""
    squares = np.nanmean(trials.squares(estimator), axis=(0, 1))
    ambiguities = np.nanmean(trials.ambiguities(estimator), axis=(0, 1))
    return Means(*(float(v) for v in (*squares, *ambiguities)))


def gain(all_trials: Iterable[Trials]) -> Means:
    """Return weighted over unweighted: the geometric mean over conditions of the ratios of means (Tab. 1)."""
    logs = []
    for trials in all_trials:
        before, after = means(trials, "unweighted"), means(trials, "weighted")
        logs.append([np.log(getattr(after, n) / getattr(before, n)) for n in Means.__slots__])
    return Means(*(float(v) for v in np.exp(np.mean(logs, axis=0))))


def correlation(a: Floats, b: Floats) -> float:
    """Return Pearson's correlation of what is finite in both; nan of fewer than three."""
    x, y = np.ravel(a), np.ravel(b)
    both = np.isfinite(x) & np.isfinite(y)
    if both.sum() < 3 or not (np.ptp(x[both]) and np.ptp(y[both])):
        return float("nan")
    return float(np.corrcoef(x[both], y[both])[0, 1])


def mean_of_pairs(pairs: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Average two columns over the rows that have a number there; nan where none has."""
    columns = np.asarray(pairs, dtype=np.float64).reshape(-1, 2).T
    first, second = (float(np.mean(c[np.isfinite(c)])) if np.isfinite(c).any() else float("nan") for c in columns)
    return first, second


def correlation_over_scans(trials: Trials, estimator: str) -> tuple[float, float]:
    """Correlate ambiguity with squared error over all scans of a condition: position, heading (Tab. 2)."""
    a, d = trials.ambiguities(estimator), trials.squares(estimator)
    return correlation(a[..., 0], d[..., 0]), correlation(a[..., 1], d[..., 1])


def correlation_within_poses(trials: Trials, estimator: str) -> tuple[float, float]:
    """Correlate over the scans of each pose, and average over the poses."""
    a, d = trials.ambiguities(estimator), trials.squares(estimator)
    each = [[correlation(a[i, :, k], d[i, :, k]) for k in range(2)] for i in range(len(a))]
    return mean_of_pairs(each)


def correlation_over_poses(trials: Trials, estimator: str) -> tuple[float, float]:
    """Correlate the means of the poses."""
    a, d = (np.nanmean(v, axis=1) for v in (trials.ambiguities(estimator), trials.squares(estimator)))
    return correlation(a[:, 0], d[:, 0]), correlation(a[:, 1], d[:, 1])


def correlation_pooled(all_trials: Sequence[Trials], estimator: str) -> tuple[float, float]:
    """Correlate over the scans of all conditions at once."""
    a = np.concatenate([t.ambiguities(estimator).reshape(-1, 2) for t in all_trials])
    d = np.concatenate([t.squares(estimator).reshape(-1, 2) for t in all_trials])
    return correlation(a[:, 0], d[:, 0]), correlation(a[:, 1], d[:, 1])


def slopes(all_trials: Sequence[Trials], estimator: str) -> dict[str, tuple[float, float]]:
    """Fit ``value = c points^a sigma^b`` to each mean; return name: (a, b)."""
    found = [means(t, estimator) for t in all_trials]
    terms = np.array([[1.0, np.log(t.condition.points), np.log(t.condition.sigma)] for t in all_trials])
    powers = {}
    for name in Means.__slots__:
        fit = np.linalg.lstsq(terms, np.log([getattr(m, name) for m in found]), rcond=None)[0]
        powers[name] = (float(fit[1]), float(fit[2]))
    return powers


def over_bound(trials: Trials, estimator: str) -> tuple[float, float]:
    """Return the root mean square errors of position and heading over the Cramer-Rao bound's."""
    squares = np.sqrt(np.nanmean(trials.squares(estimator), axis=(0, 1)))
    counts = trials.fixed.sum(axis=1)
    least = np.stack([trials.bounds[:, 0, 0] + trials.bounds[:, 1, 1], trials.bounds[:, 2, 2]], axis=1)
    bound = np.sqrt(counts @ least / counts.sum())
    return float(squares[0] / bound[0]), float(squares[1] / bound[1])
