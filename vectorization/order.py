"""Points in scanning order: those that come more than once, and those that are in no order.

Scanners with two returns, and drivers that send a beam twice, repeat points. A repeated point is no further evidence,
and its step from the one before says nothing of the angle between beams: the first of each is kept.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from registration.layout import Floats

from . import tuning

Indices = NDArray[np.int64]


def first_of_each(points: Floats) -> Indices:
    """Return the indices of the points without those that an earlier one equals to the digit, in order.

    Parameters
    ----------
    points : (n, 2)
    """
    if len(points) < 2:
        return np.arange(len(points))
    _, first = np.unique(points, axis=0, return_index=True)
    return np.arange(len(points)) if len(first) == len(points) else np.sort(first)


def without_repeats(steps: Floats, near: NDArray[np.bool_]) -> Indices:
    """Return which points are left, in order, where many lie much nearer to the one before than its neighbours do.

    Parameters
    ----------
    steps : (n - 1,)
        From each point to the next, not negative: radians between their rays, or metres.
    near : (n - 1,)
        True where noise explains the distance of the two.

    Returns
    -------
    (k,)
        All of them, where few are that near: then they are points of their own.
    """
    n = len(steps) + 1
    every = np.arange(n)
    if (
        n <= tuning.STEP_WINDOW
        or (steps < tuning.REPEATED * np.quantile(steps, tuning.SAME_BEAM)).sum() < tuning.REPEATED_SHARE * n
    ):
        return every
    # The step between beams: few of those around are longer, however often each point is repeated.
    half = tuning.STEP_WINDOW // 2
    around = np.lib.stride_tricks.sliding_window_view(np.pad(steps, half, mode="reflect"), tuning.STEP_WINDOW)
    usual = np.quantile(around, tuning.SAME_BEAM, axis=1)
    repeated = int((near & (steps < tuning.REPEATED * usual)).sum())
    between = int(((steps >= tuning.VALLEY * usual) & (steps < tuning.REPEATED_STEP * usual)).sum())
    chance = tuning.VALLEY_DEPTH * between + tuning.DEVIATIONS * math.sqrt(repeated + between)
    if repeated < max(tuning.REPEATED_SHARE * n, chance):
        return every
    left, gone = [0], 0.0
    for k, (step, limit, close) in enumerate(
        zip(steps.tolist(), (tuning.REPEATED_STEP * usual).tolist(), near.tolist(), strict=True)
    ):
        gone += step
        if gone >= limit or not close:
            left.append(k + 1)
            gone = 0.0
    return np.array(left)


def runs_around(turns: Floats) -> bool:
    """Tell whether rays run once around the viewpoint in one direction, as those of a scanner do.

    Parameters
    ----------
    turns : (n - 1,)
        From each ray to the next, radians, -pi to pi.
    """
    n = len(turns) + 1
    if n < tuning.LEAST_ORDERED:
        return True
    angles = np.sort(np.mod(np.concatenate(([0.0], np.cumsum(turns))), math.tau))
    covered = math.tau - float(np.diff(angles, append=angles[0] + math.tau).max())
    # Small steps back and forth, as noise makes them, cancel.
    small = np.abs(turns) <= max(tuning.JITTER, 2.0 * covered / n)
    drift = float(turns[small].sum())
    forward = float(turns[~small & (turns > 0.0)].sum()) + max(0.0, drift)
    backward = -float(turns[~small & (turns < 0.0)].sum()) + max(0.0, -drift)
    # A scan may begin anywhere: one step back to its other end is none of a second pass.
    return max(forward, backward) <= tuning.MOST_PASSES * covered


def runs_along(points: Floats) -> bool:
    """Tell whether points follow one another, as they do along walls: the next is not much farther than the nearest.

    Parameters
    ----------
    points : (n, 2) metres
    """
    n = len(points)
    if n < tuning.LEAST_ORDERED:
        return True
    probes = np.unique(np.linspace(0, n - 2, min(tuning.PROBES, n - 1)).astype(np.int64))
    apart = np.hypot(*(points[probes, None, :] - points[None, :, :]).transpose(2, 0, 1))
    following = apart[np.arange(len(probes)), probes + 1]
    apart[np.arange(len(probes)), probes] = math.inf
    return float(np.median(following)) <= tuning.SCATTERED * float(np.median(apart.min(axis=1)))
