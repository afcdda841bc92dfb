"""Effect on Tabs. 1 and 2 of each choice that the paper leaves open, changed separately."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from .accuracy import (
    Means,
    correlation_over_poses,
    correlation_over_scans,
    correlation_pooled,
    correlation_within_poses,
    gain,
    mean_of_pairs,
    means,
)
from .gains import TAB_1, TAB_2
from .measuring import Setup
from .output import BLUE, ORANGE, SKY, VERMILION, Cell, new_figure, save, write_table
from .plan import Plan
from .running import Runner
from .scenes import NAMES
from .sweep import TRUE_CORNERS
from .trials import PAPERS, Condition, Trials, run

SETUPS = {
    "vectorized": Setup(),
    "vectorized, 20 units and longer": Setup(min_length=20.0),
    "vectorized, 40 units and longer": Setup(min_length=40.0),
    "vectorized, also segments across two walls": Setup(purity=0.0),
    "vectorized, noise of both coordinates": Setup(noise="point"),
    "vectorized, origin amid the scan": Setup(origin="middle"),
    "vectorized, origin of the map": Setup(origin="map"),
    "vectorized, scattered poses": Setup(places="scattered"),
    "true corners, 3 points and more": TRUE_CORNERS,
    "true corners, 3 points, noise of both coordinates": Setup(
        cut="walls", min_points=3, min_length=0.0, noise="point"
    ),
    "true corners, 4 points and 10 units": Setup(cut="walls"),
    "true corners, 20 units and longer": Setup(cut="walls", min_length=20.0),
    "true corners, 40 units and longer": Setup(cut="walls", min_length=40.0),
}
SQUARES = ("CutSquare", "CutSquare, cut of 141", "CutSquare, cut of 71", "CutSquare, notch of 100")
SQUARE_SETUPS = ("vectorized", "true corners, 3 points and more")


def hypotheses(plan: Plan, runner: Runner, out: Path) -> None:
    """Take the scans under each setup; write the gains and correlations that each gives."""
    keys = [(setup, name) for setup in SETUPS for name in NAMES]
    keys += [(setup, name) for setup in SQUARE_SETUPS for name in SQUARES[1:]]
    jobs = [
        Condition(name, points, sigma, plan.test_scans, plan.seed, SETUPS[setup])
        for setup, name in keys
        for points in plan.test_points
        for sigma in plan.sigmas
    ]
    done = runner.map("hypotheses", run, jobs)
    n = len(plan.test_points) * len(plan.sigmas)
    found = {key: done[k * n : (k + 1) * n] for k, key in enumerate(keys)}
    _write_gains(found, out)
    _write_definitions(found, out)
    _draw({key: trials for key, trials in found.items() if key[1] in NAMES}, out)


def _write_gains(found: dict[tuple[str, str], list[Trials]], out: Path) -> None:
    rows: list[Sequence[Cell]] = [
        ["paper", name, *(float(v[k]) for v in (*TAB_1.values(), *TAB_2.values())), ""] for k, name in enumerate(NAMES)
    ]
    for (setup, name), trials in found.items():
        ratios = gain(trials)
        both = [mean_of_pairs([correlation_over_scans(t, e) for t in trials]) for e in PAPERS]
        pairs = float(np.mean([t.pairs.mean() for t in trials]))
        rows.append(
            [setup, name, *(float(getattr(ratios, w)) for w in TAB_1), *(float(v) for v in np.ravel(both)), pairs]
        )
    write_table(out / "hypotheses.csv", ("setup", "environment", *TAB_1, *TAB_2, "pairs"), rows)


def gains_defined_otherwise(trials: Sequence[Trials]) -> dict[str, Means]:
    """Return Tab. 1 under other readings of what is averaged and how weights are scaled."""
    before, after = ([means(t, e) for t in trials] for e in PAPERS)

    def ratio(of: list[Means], over: list[Means], how: str) -> Means:
        names = Means.__slots__
        if how == "of sums":
            return Means(*(sum(getattr(m, n) for m in of) / sum(getattr(m, n) for m in over) for n in names))
        each = [[getattr(a, n) / getattr(b, n) for n in names] for a, b in zip(of, over, strict=True)]
        return Means(*(float(v) for v in np.mean(each, axis=0)))

    return {
        "geometric mean over conditions": gain(trials),
        "arithmetic mean over conditions": ratio(after, before, "mean"),
        "sums over conditions": ratio(after, before, "of sums"),
        "medians of the scans": _medians(trials),
        "roots of the mean squares": _powered(gain(trials), 0.5),
        "weights not divided by their sum": _unnormalised(trials),
        "error of the transform, not of the sensor": _own(trials),
    }


def _medians(trials: Sequence[Trials]) -> Means:
    logs = []
    for t in trials:
        values = [
            [*np.nanmedian(t.squares(e), axis=(0, 1)), *np.nanmedian(t.ambiguities(e), axis=(0, 1))] for e in PAPERS
        ]
        logs.append(np.log(values[1]) - np.log(values[0]))
    return Means(*(float(v) for v in np.exp(np.mean(logs, axis=0))))


def _powered(ratios: Means, power: float) -> Means:
    return Means(*(getattr(ratios, n) ** power for n in Means.__slots__))


def _unnormalised(trials: Sequence[Trials]) -> Means:
    ratios, logs = gain(trials), []
    for t in trials:
        sums = [np.nanmean(t.ambiguities(e) * t.weights[:, :, t.of(e), None], axis=(0, 1)) for e in PAPERS]
        logs.append(np.log(sums[1]) - np.log(sums[0]))
    raw = np.exp(np.mean(logs, axis=0))
    return Means(ratios.D_t, ratios.D_alpha, float(raw[0]), float(raw[1]))


def _own(trials: Sequence[Trials]) -> Means:
    ratios, logs = gain(trials), []
    for t in trials:
        squares = [np.nanmean(t.squares(e, own=True), axis=(0, 1)) for e in PAPERS]
        logs.append(np.log(squares[1]) - np.log(squares[0]))
    own = np.exp(np.mean(logs, axis=0))
    return Means(float(own[0]), float(own[1]), ratios.A_t, ratios.A_alpha)


def _write_definitions(found: dict[tuple[str, str], list[Trials]], out: Path) -> None:
    gains: list[Sequence[Cell]] = []
    correlations: list[Sequence[Cell]] = []
    for setup in ("vectorized", "vectorized, origin of the map", "true corners, 3 points and more"):
        for name in NAMES:
            trials = found[setup, name]
            for how, ratios in gains_defined_otherwise(trials).items():
                gains.append([setup, name, how, *(float(getattr(ratios, w)) for w in TAB_1)])
            for how, correlate in (
                ("scans of all poses", correlation_over_scans),
                ("means of the poses", correlation_over_poses),
                ("scans of each pose", correlation_within_poses),
            ):
                both = [mean_of_pairs([correlate(t, e) for t in trials]) for e in PAPERS]
                correlations.append([setup, name, how, *(float(v) for v in np.ravel(both))])
            both = [correlation_pooled(trials, e) for e in PAPERS]
            correlations.append([setup, name, "scans of all conditions", *(float(v) for v in np.ravel(both))])
    write_table(out / "definitions_tab1.csv", ("setup", "environment", "read as", *TAB_1), gains)
    write_table(out / "definitions_tab2.csv", ("setup", "environment", "correlated over", *TAB_2), correlations)


def _draw(found: dict[tuple[str, str], list[Trials]], out: Path) -> None:
    """Draw the gains and correlations of each setup as points in a row, the paper's as lines."""
    figure = new_figure(10.0, 7.6)
    grid = figure.subplots(2, 3, sharey=True, sharex="row")
    rows = list(SETUPS)
    for column, name in enumerate(NAMES):
        ratios = [gain(found[s, name]) for s in rows]
        _rows_of_points(grid[0, column], {w: ([getattr(r, w) for r in ratios], TAB_1[w][column]) for w in TAB_1})
        over = [mean_of_pairs([correlation_over_scans(t, "unweighted") for t in found[s, name]]) for s in rows]
        values = {w: ([o[k] for o in over], TAB_2[w][column]) for k, w in enumerate(("Corr_t", "Corr_alpha"))}
        _rows_of_points(grid[1, column], values)
        grid[0, column].set(title=name, xlim=(0.0, 1.1), xlabel="weighted over unweighted")
        grid[1, column].set(xlim=(0.0, 1.05), xlabel="correlation over scans, unweighted")
    for axes, corner in zip(grid[:, 0], ("lower left", "upper left"), strict=True):
        axes.set_yticks(range(len(rows)), rows, fontsize=7)
        axes.legend(fontsize=6.5, loc=corner, facecolor="white", frameon=True, edgecolor="none")
    grid[0, 0].invert_yaxis()
    figure.supxlabel("marks: measured; dashed lines: the paper", fontsize=8)
    save(figure, out / "hypotheses.png")


def _rows_of_points(axes: Axes, values: dict[str, tuple[list[float], float]]) -> None:
    colours = (BLUE, SKY, ORANGE, VERMILION)
    for (what, (row, printed)), colour, mark in zip(values.items(), colours, "osD^", strict=False):
        axes.plot(row, range(len(row)), mark, color=colour, ms=4, label=what)
        axes.axvline(printed, color=colour, lw=1.0, ls="--")
