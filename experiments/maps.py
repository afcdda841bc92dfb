"""Environments with what was estimated in them, drawn in the paper's manner."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import Ellipse, Wedge
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from .output import BLUE, GREEN, INK, MAP
from .scenes import GRID, UNIT, Places, poses, world
from .trials import Trials

Floats = NDArray[np.float64]

DEVIATIONS = 3.0  # that ellipses and pies show
PIE = 22.0  # units, radius


def draw_world(axes: Axes, name: str, title: str, places: Places = "path") -> None:
    """Draw walls, path and poses on the grid of 50 units."""
    segments = world(name).segments.endpoints.reshape(-1, 2, 2) / UNIT
    axes.add_collection(LineCollection(list(segments), colors=MAP, linewidths=3.5, capstyle="round", zorder=2))
    spots = np.array([[p.x, p.y] for p in poses(name, places)]) / UNIT
    if places == "path":
        path = np.vstack([spots, spots[:1]])
        axes.plot(path[:, 0], path[:, 1], "--", color=INK, lw=0.7, alpha=0.6, zorder=2.5)
    axes.plot(spots[:, 0], spots[:, 1], ".", color=INK, ms=4, zorder=5)
    corners = segments.reshape(-1, 2)
    low, high = corners.min(axis=0) - 20.0, corners.max(axis=0) + 20.0
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal", title=title)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(GRID))
    axes.tick_params(labelbottom=False, labelleft=False, length=0)


def draw_dispersion(axes: Axes, trials: Trials, estimator: str, magnified: float = 1.0) -> None:
    """Draw the ellipse of the positions from each pose, and the pie of the headings, three deviations each.

    Parameters
    ----------
    axes : Axes
    trials : Trials
    estimator : str
    magnified : float
        Factors by which their size, and their distance from the truth, are drawn.
    """
    off = trials.errors[:, :, trials.of(estimator)]
    for pose, fixed, errors in zip(poses(trials.condition.world), trials.fixed, off, strict=True):
        if fixed.sum() < 3:
            continue
        mean, covariance = magnified * errors[fixed].mean(axis=0), magnified**2 * np.cov(errors[fixed].T)
        x, y = pose.x / UNIT + float(mean[0]), pose.y / UNIT + float(mean[1])
        _ellipse(axes, (x, y), covariance[:2, :2])
        heading, half = math.degrees(pose.theta + mean[2]), math.degrees(DEVIATIONS * math.sqrt(covariance[2, 2]))
        half = min(half, 180.0)
        axes.add_patch(Wedge((x, y), PIE, heading - half, heading + half, color=BLUE, alpha=0.55, lw=0, zorder=3))
        axes.plot(
            [x, x + PIE * math.cos(math.radians(heading))],
            [y, y + PIE * math.sin(math.radians(heading))],
            color=BLUE,
            lw=0.8,
            zorder=3,
        )


def _ellipse(axes: Axes, centre: tuple[float, float], covariance: Floats) -> None:
    sizes, vectors = np.linalg.eigh(covariance)
    axes.add_patch(
        Ellipse(
            centre,
            2.0 * DEVIATIONS * math.sqrt(max(0.0, sizes[1])),
            2.0 * DEVIATIONS * math.sqrt(max(0.0, sizes[0])),
            angle=math.degrees(math.atan2(vectors[1, 1], vectors[0, 1])),
            facecolor=GREEN,
            edgecolor=GREEN,
            alpha=0.45,
            zorder=4,
        )
    )
