"""Error over the number of points with many short walls: for all segments, and for long ones only."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from .accuracy import means
from .measuring import Setup
from .output import BLUE, ORANGE, Cell, new_figure, save, write_table
from .plan import Plan
from .running import Runner
from .sweep import TRUE_CORNERS
from .trials import Condition, run

WORLDS = ("Oblique", "Pillars")
SIGMA = 3.0
SETUPS = {
    "vectorized": Setup(),
    "vectorized, 40 units and longer": Setup(min_length=40.0),
    "true corners, 3 points and more": TRUE_CORNERS,
    "true corners, 40 units and longer": Setup(cut="walls", min_length=40.0),
}
STYLES = dict(zip(SETUPS, ((BLUE, "-o"), (BLUE, "--o"), (ORANGE, "-s"), (ORANGE, "--s")), strict=True))


def crumbs(plan: Plan, runner: Runner, out: Path) -> None:
    """Write the unweighted error over the points."""
    points = plan.points[:: max(1, len(plan.points) // 4)]
    keys = [(name, setup, count) for name in WORLDS for setup in SETUPS for count in points]
    jobs = [Condition(name, count, SIGMA, plan.test_scans, plan.seed, SETUPS[setup]) for name, setup, count in keys]
    done = runner.map("error with and without crumbs", run, jobs)
    roots = {key: math.sqrt(means(trials, "unweighted").D_t) for key, trials in zip(keys, done, strict=True)}
    rows: list[Sequence[Cell]] = [
        [*key, SIGMA, roots[key], float(trials.pairs.mean())] for key, trials in zip(keys, done, strict=True)
    ]
    write_table(out / "crumbs.csv", ("environment", "segments", "points", "sigma", "rms_position", "pairs"), rows)
    figure = new_figure(10.0, 3.6)
    for axes, name in zip(figure.subplots(1, 2, sharey=True), WORLDS, strict=True):
        for setup, (colour, style) in STYLES.items():
            axes.loglog(points, [roots[name, setup, p] for p in points], style, color=colour, ms=4, label=setup)
        axes.set(title=f"{name}, unweighted, σ = {SIGMA:g}", xlabel="points per scan")
        axes.set_xticks(points, [str(p) for p in points])
        axes.set_xticks([], minor=True)
    figure.axes[0].set_ylabel("RMS error of the position, units")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    save(figure, out / "crumbs.png")
