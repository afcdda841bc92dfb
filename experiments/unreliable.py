"""Fig. 9: reliability from the poses of Pillars, where only long edges count."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle

from .maps import draw_world
from .measuring import Setup
from .output import BLUE, GREEN, INK, Cell, new_figure, save, write_table
from .plan import Plan
from .running import Runner
from .scenes import UNIT, poses
from .trials import Condition, Trials, run

POINTS, SIGMA = 300, 10.0
RADIUS = 24.0  # units, where R = 1
LOW = 0.5
# The paper's threshold; a higher one; the paper's, where the scans are taken elsewhere.
SETUPS = (Setup(min_length=80.0), Setup(min_length=100.0), Setup(min_length=80.0, places="scattered"))


def unreliable(plan: Plan, runner: Runner, out: Path) -> None:
    """Take the scans and write the reliabilities."""
    done = runner.map(
        "reliability", run, [Condition("Pillars", POINTS, SIGMA, plan.scans, plan.seed, s) for s in SETUPS]
    )
    figure = new_figure(10.0, 3.3)
    for axes, trials in zip(figure.subplots(1, 3), done, strict=True):
        setup = trials.condition.setup
        where = "the path" if setup.places == "path" else "scattered poses"
        draw_world(axes, "Pillars", f"{setup.min_length:g} units or longer, {where}", setup.places)
        _draw_reliability(axes, trials)
    head = (
        "least_length",
        "poses",
        "x",
        "y",
        "mean_R",
        "least_R",
        "share_of_R_below_0.5",
        "not_fixed",
        "pairs",
        "rms_error",
    )
    write_table(out / "fig9_reliability.csv", head, [row for trials in done for row in _rows(trials)])
    save(figure, out / "fig9_reliability.png")


def _draw_reliability(axes: Axes, trials: Trials) -> None:
    """Draw a circle for each pose, filled by the mean of all scans; the lowest of single scans in blue."""
    reliability = trials.reliability[:, :, trials.of("weighted")]
    lowest = reliability == reliability[reliability > 0.0].min()
    for pose, values, is_lowest in zip(
        poses("Pillars", trials.condition.setup.places), reliability, lowest, strict=True
    ):
        centre = pose.x / UNIT, pose.y / UNIT
        for radius in RADIUS * np.sqrt(values):
            axes.add_patch(Circle(centre, radius, color=GREEN, lw=0, alpha=1.5 / len(values), zorder=3))
        axes.add_patch(Circle(centre, RADIUS, fill=False, color=INK, lw=1.0, zorder=4))
        if is_lowest.any():
            least = RADIUS * math.sqrt(float(values[is_lowest][0]))
            axes.add_patch(Circle(centre, least, fill=False, color=BLUE, lw=1.8, zorder=5))


def _rows(trials: Trials) -> list[Sequence[Cell]]:
    """Return a row for each pose."""
    setup, reliability = trials.condition.setup, trials.reliability[:, :, trials.of("weighted")]
    squares = trials.squares("weighted")[..., 0]
    rows: list[Sequence[Cell]] = []
    for k, pose in enumerate(poses("Pillars", setup.places)):
        fixed, values = trials.fixed[k], reliability[k]
        error = math.sqrt(float(squares[k][fixed].mean())) if fixed.any() else math.nan
        shares = float((values < LOW).mean()), float(1.0 - fixed.mean())
        numbers = float(values.mean()), float(values.min()), *shares, float(trials.pairs[k].mean()), error
        rows.append([setup.min_length, setup.places, pose.x / UNIT, pose.y / UNIT, *numbers])
    return rows
