"""Both estimators over the Cramer-Rao bound."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from .accuracy import over_bound
from .output import BLUE, GREY, ORANGE, SKY, Cell, new_figure, save, write_table
from .scenes import NAMES
from .trials import ESTIMATORS, Trials

Ratios = dict[tuple[str, str, int, float], tuple[float, float]]

TICKS = (1, 2, 5, 10, 20, 50, 100, 200)
COLOURS = {"unweighted": GREY, "weighted": ORANGE, "information": SKY, "joint": BLUE}
LABELS = {
    "unweighted": "one_step, unweighted",
    "weighted": "one_step, by length",
    "information": "one_step, by information",
    "joint": "joint",
}


def efficiency(sources: Mapping[str, Sequence[Trials]], out: Path) -> None:
    """Write root mean square errors over the bound of all beams."""
    rows: list[Sequence[Cell]] = []
    for source, all_trials in sources.items():
        ratios: Ratios = {}
        for trials in all_trials:
            c = trials.condition
            for estimator in ESTIMATORS:
                ratio = over_bound(trials, estimator)
                rows.append([source, c.world, c.points, c.sigma, estimator, *ratio])
                ratios[c.world, estimator, c.points, c.sigma] = ratio
        _draw(source, ratios, out / f"bound_{source.replace(' ', '_')}.png")
    head = ("segments", "environment", "points", "sigma", "estimator", "position_over_bound", "heading_over_bound")
    write_table(out / "bound.csv", head, rows)


def _draw(source: str, ratios: Ratios, path: Path) -> None:
    figure = new_figure(10.0, 5.8)
    grid = figure.subplots(2, 3, sharex=True, sharey="row")
    points = sorted({key[2] for key in ratios})
    styles = dict(zip(sorted({key[3] for key in ratios}), (":", "--", "-"), strict=False))
    for column, name in enumerate(NAMES):
        for row, what in enumerate(("position", "heading")):
            axes = grid[row, column]
            for estimator in ESTIMATORS:
                for sigma, style in styles.items():
                    values = [ratios[name, estimator, p, sigma][row] for p in points]
                    label = f"{LABELS[estimator]}, σ = {sigma:g}"
                    axes.loglog(points, values, style, color=COLOURS[estimator], lw=1.4, label=label)
            axes.axhline(1.0, color="black", lw=0.8)
            axes.set_title(f"{name}, {what}")
            axes.set_xticks(points, [str(p) for p in points], fontsize=7)
            axes.set_xticks([], minor=True)
            axes.set_yticks(TICKS, [str(t) for t in TICKS])
            axes.set_yticks([], minor=True)
        grid[1, column].set_xlabel(f"points per scan ({source})")
    grid[0, 0].set_ylabel("RMS error over the bound")
    grid[1, 0].set_ylabel("RMS error over the bound")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    save(figure, path)
