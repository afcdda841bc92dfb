"""Fig. 6: errors and ambiguities over the points of a scan."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from .accuracy import means, slopes
from .output import GREEN, GREY, Cell, new_figure, save, write_table
from .trials import ESTIMATORS, Trials, of_world

ERRORS_HEAD = ("segments", "estimator", "points", "sigma", "D_t", "A_t", "D_alpha", "A_alpha", "pairs")
SLOPES_HEAD = ("segments", "estimator", "mean", "power_of_points", "power_of_sigma")


def error_curves(sources: Mapping[str, Sequence[Trials]], out: Path) -> None:
    """Write Fig. 6, which is of CutSquare."""
    own = {source: of_world(all_trials, "CutSquare") for source, all_trials in sources.items()}
    rows: list[Sequence[Cell]] = []
    powers: list[Sequence[Cell]] = []
    for source, all_trials in own.items():
        for estimator in ESTIMATORS:
            for trials in all_trials:
                m = means(trials, estimator)
                condition = trials.condition.points, trials.condition.sigma
                rows.append(
                    [source, estimator, *condition, m.D_t, m.A_t, m.D_alpha, m.A_alpha, float(trials.pairs.mean())]
                )
            for what, (a, b) in slopes(all_trials, estimator).items():
                powers.append([source, estimator, what, a, b])
    write_table(out / "fig6_errors.csv", ERRORS_HEAD, rows)
    write_table(out / "fig6_slopes.csv", SLOPES_HEAD, powers)
    figure = new_figure(10.0, 7.4)
    grid = figure.subplots(2, 2, sharex=True, sharey="col")
    for row, (source, all_trials) in zip(grid, own.items(), strict=True):
        for axes, kind in zip(row, ("t", "alpha"), strict=True):
            _error_curves(axes, all_trials, kind, source)
    save(figure, out / "fig6_errors.png")


def _error_curves(axes: Axes, all_trials: Sequence[Trials], kind: str, source: str) -> None:
    """Draw A in green over the error in grey, brought to one scale as the paper's are."""
    found = {(t.condition.sigma, t.condition.points): means(t, "unweighted") for t in all_trials}
    ratios = [np.log(getattr(m, f"A_{kind}") / getattr(m, f"D_{kind}")) for m in found.values()]
    scale = float(np.exp(np.median(ratios)))
    for sigma in sorted({s for s, _ in found}):
        points = [p for s, p in found if s == sigma]
        ambiguity = [getattr(found[sigma, p], f"A_{kind}") / scale for p in points]
        error = [getattr(found[sigma, p], f"D_{kind}") for p in points]
        axes.loglog(points, error, "-", color=GREY, lw=3.5, label="mean square error")
        axes.loglog(points, ambiguity, "-o", color=GREEN, ms=3, lw=1.2, label=f"ambiguity / {scale:.2g}")
        axes.annotate(f"σ = {sigma:g}", (points[-1], error[-1]), xytext=(4, 0), textcoords="offset points", va="center")
    what, unit = ("position", "units²") if kind == "t" else ("heading", "rad²")
    handles, labels = axes.get_legend_handles_labels()
    axes.legend(handles[:2], labels[:2], loc="lower left")
    ticks = sorted({p for _, p in found})
    axes.set_xticks(ticks, [str(p) for p in ticks])
    axes.set_xticks([], minor=True)
    axes.set_xlim(ticks[0] * 0.93, ticks[-1] * 1.35)
    axes.set(title=f"CutSquare, {what}, unweighted, {source}", xlabel="points per scan", ylabel=f"{what}, {unit}")
