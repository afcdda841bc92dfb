"""Figures with their goals, and the machine that they were measured on."""

from __future__ import annotations

import math
import os
import platform
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numba
import numpy as np


@dataclass(frozen=True, slots=True)
class Row:
    """A figure and what was asked of it.

    Attributes
    ----------
    what, measured : str
    goal, aim : str
        The goal that must be reached, and a further aim; empty for none.
    met, aimed : bool or None
        True if they were; None without a goal or a measurement.
    """

    what: str
    measured: str
    goal: str = ""
    met: bool | None = None
    aim: str = ""
    aimed: bool | None = None


def at_least(what: str, value: float, goal: float | None = None, aim: float | None = None, form: str = ".3f") -> Row:
    """Return the row of a figure that should be high; nan for one that could not be measured."""
    return _row(what, value, (goal, aim), form, ">= ", lambda limit: value >= limit)


def at_most(what: str, value: float, goal: float | None = None, aim: float | None = None, form: str = ".3f") -> Row:
    """Return the row of a figure that should be low; nan for one that could not be measured."""
    return _row(what, value, (goal, aim), form, "<= ", lambda limit: value <= limit)


def within(what: str, value: float, low: float, high: float, form: str = ".3f") -> Row:
    """Return the row of a figure that should lie in an interval."""
    return Row(what, format(value, form), f"{low:g} to {high:g}", low <= value <= high)


def _row(
    what: str,
    value: float,
    goals: tuple[float | None, float | None],
    form: str,
    sign: str,
    test: Callable[[float], bool],
) -> Row:
    told = ["" if limit is None else f"{sign}{limit:g}" for limit in goals]
    met = [None if limit is None or math.isnan(value) else test(limit) for limit in goals]
    return Row(what, "not measured" if math.isnan(value) else format(value, form), told[0], met[0], told[1], met[1])


def mean(values: Iterable[float]) -> float:
    """Return the mean, nan of nothing."""
    listed = list(values)
    return float(np.mean(listed)) if listed else math.nan


def quantile(values: Iterable[float], share: float) -> float:
    """Return a quantile, nan of nothing."""
    listed = list(values)
    return float(np.quantile(listed, share)) if listed else math.nan


def print_rows(title: str, rows: Sequence[Row]) -> None:
    """Print rows with what was asked, and whether it was reached or falls short."""
    cells = [(r.what, r.measured, r.goal, _verdict(r.met), r.aim, _verdict(r.aimed)) for r in rows]
    head = ("what", "measured", "goal", "", "aim", "")
    aims = any(r.aim for r in rows)
    print_table(title, head if aims else head[:4], [c if aims else c[:4] for c in cells])


def print_table(title: str, head: Sequence[str], cells: Sequence[Sequence[str]]) -> None:
    """Print a Markdown table, its columns aligned."""
    widths = [max(len(str(row[k])) for row in [head, *cells]) for k in range(len(head))]
    print(f"\n### {title}\n")
    for row in [head, ["-" * w for w in widths], *cells]:
        print("| " + " | ".join(str(c).ljust(w) for c, w in zip(row, widths, strict=True)) + " |")


def _verdict(met: bool | None) -> str:
    return "" if met is None else "pass" if met else "SHORT"


def machine() -> str:
    """Describe the machine in one line."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        names = [
            line.split(":", 1)[1].strip() for line in info.read_text().splitlines() if line.startswith("model name")
        ]
        model = names[0] if names else model
    return (
        f"{model}, {os.cpu_count()} cores, {platform.system()}, Python {platform.python_version()}, "
        f"numpy {np.__version__}, numba {numba.__version__}"
    )
