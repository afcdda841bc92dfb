"""Fig. 5, 7 and 8: the environments, and how estimated poses scatter in them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .maps import draw_dispersion, draw_world
from .output import Cell, new_figure, save, write_table
from .plan import Plan
from .running import Runner
from .scenes import NAMES, UNIT, poses, world
from .trials import PAPERS, Condition, Trials, run

# Of Fig. 7: five conditions of CutSquare and the one of Pillars that is named; Fig. 8 is the latter, weighted.
CUT_SQUARE_SHOWN = ((100, 3.0), (300, 3.0), (1000, 3.0), (300, 1.0), (300, 10.0))
PILLARS_SHOWN = (300, 5.0)
MAGNIFIED = {"CutSquare": 10, "Pillars": 3}  # what is drawn of the dispersion
HEAD = (
    "environment", "points", "sigma", "estimator", "x", "y", "mean_off_x", "mean_off_y", "sd_major", "sd_minor",
    "tilt_degrees", "mean_off_degrees", "sd_degrees",
)  # fmt: skip


def dispersion(plan: Plan, runner: Runner, out: Path) -> None:
    """Take the scans of Fig. 7 and 8 and write them; and Fig. 5."""
    figure = new_figure(10.0, 4.0)
    for axes, name in zip(figure.subplots(1, 3), NAMES, strict=True):
        draw_world(axes, name, name)
    save(figure, out / "fig5_environments.png")
    ends: list[Sequence[Cell]] = [
        [name, *(float(v) for v in row / UNIT)] for name in NAMES for row in world(name).segments.endpoints
    ]
    write_table(out / "fig5_environments.csv", ("environment", "x1", "y1", "x2", "y2"), ends)

    shown = [Condition("CutSquare", *c, plan.scans, plan.seed) for c in CUT_SQUARE_SHOWN]
    shown.append(Condition("Pillars", *PILLARS_SHOWN, plan.scans, plan.seed))
    dispersed = runner.map("scans for the maps", run, shown)
    figure = new_figure(10.0, 6.6)
    for axes, letter, trials in zip(figure.subplots(2, 3).flat, "abcdef", dispersed, strict=True):
        c = trials.condition
        draw_world(axes, c.world, f"({letter}) {c.world}, P = {c.points}, σ = {c.sigma:g}; × {MAGNIFIED[c.world]}")
        draw_dispersion(axes, trials, "unweighted", MAGNIFIED[c.world])
    write_table(out / "fig7_dispersion.csv", HEAD, [r for t in dispersed for r in _rows(t, "unweighted")])
    save(figure, out / "fig7_dispersion.png")

    figure = new_figure(10.0, 4.4)
    for axes, estimator in zip(figure.subplots(1, 2), PAPERS, strict=True):
        points, sigma = PILLARS_SHOWN
        draw_world(axes, "Pillars", f"Pillars, P = {points}, σ = {sigma:g}, {estimator}; × {MAGNIFIED['Pillars']}")
        draw_dispersion(axes, dispersed[-1], estimator, MAGNIFIED["Pillars"])
    write_table(out / "fig8_weighted.csv", HEAD, [r for e in PAPERS for r in _rows(dispersed[-1], e)])
    save(figure, out / "fig8_weighted.png")


def _rows(trials: Trials, estimator: str) -> list[Sequence[Cell]]:
    """Return the dispersion from each pose: in units and degrees."""
    c, off = trials.condition, trials.errors[:, :, trials.of(estimator)]
    rows: list[Sequence[Cell]] = []
    for pose, fixed, errors in zip(poses(c.world), trials.fixed, off, strict=True):
        mean, covariance = errors[fixed].mean(axis=0), np.cov(errors[fixed].T)
        sizes, vectors = np.linalg.eigh(covariance[:2, :2])
        minor, major = np.sqrt(np.maximum(sizes, 0.0))
        numbers = [
            pose.x / UNIT, pose.y / UNIT, mean[0], mean[1], major, minor,
            np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1])) % 180.0,
            np.degrees(mean[2]), np.degrees(np.sqrt(covariance[2, 2])),
        ]  # fmt: skip
        rows.append([c.world, c.points, c.sigma, estimator, *(float(v) for v in numbers)])
    return rows
