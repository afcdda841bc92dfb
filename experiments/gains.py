"""Tab. 1 and 2: what weighting gains, and how far the ambiguity tells the error; next to the paper's numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from .accuracy import correlation_over_poses, correlation_over_scans, gain
from .output import BLUE, GREY, ORANGE, SKY, VERMILION, Cell, bars, new_figure, save, write_table
from .scenes import NAMES
from .trials import PAPERS, Trials, of_world

# As printed, CutSquare, Oblique, Pillars.
TAB_1 = {
    "A_t": (0.68, 0.46, 0.27),
    "A_alpha": (0.65, 0.43, 0.25),
    "D_t": (0.58, 0.25, 0.07),
    "D_alpha": (0.66, 0.27, 0.07),
}
TAB_2 = {
    "Corr_t": (0.90, 0.91, 0.77),
    "Corr_alpha": (0.59, 0.82, 0.58),
    "Corr_tw": (0.91, 0.80, 0.74),
    "Corr_alphaw": (0.53, 0.56, 0.61),
}
COLOURS = {"paper": GREY, "vectorized": BLUE, "cut at the true corners": ORANGE}


def gain_table(sources: Mapping[str, Sequence[Trials]], out: Path) -> None:
    """Write Tab. 1 for each source of segments next to the paper's."""
    columns = {source: {name: gain(of_world(trials, name)) for name in NAMES} for source, trials in sources.items()}
    rows: list[Sequence[Cell]] = []
    figure = new_figure(10.0, 5.6)
    for axes, (what, printed) in zip(figure.subplots(2, 2).flat, TAB_1.items(), strict=True):
        series = {"paper": list(printed)}
        series |= {source: [getattr(found[name], what) for name in NAMES] for source, found in columns.items()}
        rows += [[what, name, *(float(values[k]) for values in series.values())] for k, name in enumerate(NAMES)]
        bars(axes, NAMES, [(source, values, COLOURS[source]) for source, values in series.items()], ".2f")
        axes.set(title=f"{what}, weighted over unweighted", ylim=(0.0, 1.0))
    axes.legend(loc="upper right")
    write_table(out / "tab1_weighting.csv", ("metric", "environment", "paper", *sources), rows)
    save(figure, out / "tab1_weighting.png")


def correlations(all_trials: Sequence[Trials], name: str) -> dict[str, dict[str, float]]:
    """Return the four rows of Tab. 2 for an environment, over scans and over the means of poses.

    Each is the mean over the conditions; the paper saw no influence of points and noise.
    """
    found = {}
    for how, correlate in (("scans", correlation_over_scans), ("poses", correlation_over_poses)):
        both = {e: np.mean([correlate(t, e) for t in of_world(all_trials, name)], axis=0) for e in PAPERS}
        values = [float(v) for e in PAPERS for v in both[e]]
        found[how] = dict(zip(TAB_2, values, strict=True))
    return found


def correlation_table(sources: Mapping[str, Sequence[Trials]], out: Path) -> None:
    """Write Tab. 2, over scans and over the means of poses, next to the paper's."""
    found = {(source, name): correlations(trials, name) for source, trials in sources.items() for name in NAMES}
    series: dict[str, dict[str, list[float]]] = {"paper": {what: list(v) for what, v in TAB_2.items()}}
    for source in sources:
        for how in ("scans", "poses"):
            series[f"{source}, over {how}"] = {w: [found[source, n][how][w] for n in NAMES] for w in TAB_2}
    rows: list[Sequence[Cell]] = []
    figure = new_figure(10.0, 5.6)
    colours = (GREY, BLUE, SKY, VERMILION, ORANGE)
    for axes, what in zip(figure.subplots(2, 2).flat, TAB_2, strict=True):
        rows += [[what, name, *(values[what][k] for values in series.values())] for k, name in enumerate(NAMES)]
        bars(axes, NAMES, [(s, v[what], colours[k]) for k, (s, v) in enumerate(series.items())], ".2f")
        axes.set(title=what, ylim=(0.0, 1.15))
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    write_table(out / "tab2_correlation.csv", ("coefficient", "environment", *series), rows)
    save(figure, out / "tab2_correlation.png")
