"""One sweep of scans over environments, points and noise, and all that is read off it."""

from __future__ import annotations

from pathlib import Path

from .efficiency import efficiency
from .error_curves import error_curves
from .gains import correlation_table, gain_table
from .measuring import Setup
from .plan import Plan
from .running import Runner
from .scenes import NAMES
from .trials import ESTIMATORS, Condition, run

# Segments of any length, from three points up, that begin and end where the walls do.
TRUE_CORNERS = Setup(cut="walls", min_points=3, min_length=0.0)


def conditions(plan: Plan, setup: Setup) -> list[Condition]:
    """Return all conditions of all environments."""
    return [
        Condition(name, points, sigma, plan.scans, plan.seed, setup, tuple(ESTIMATORS))
        for name in NAMES
        for points in plan.points
        for sigma in plan.sigmas
    ]


def sweep(plan: Plan, runner: Runner, out: Path) -> None:
    """Take the scans; write Fig. 6, Tabs. 1 and 2, and the errors over the bound."""
    sources = {
        "vectorized": runner.map("scans, vectorized", run, conditions(plan, Setup())),
        "cut at the true corners": runner.map("scans, cut at the true corners", run, conditions(plan, TRUE_CORNERS)),
    }
    error_curves(sources, out)
    gain_table(sources, out)
    correlation_table(sources, out)
    efficiency(sources, out)
