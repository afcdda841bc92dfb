"""Sec. 4.5 and Fig. 10: Mitsuta's and Wahba's mean of angles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .output import GREEN, INK, Cell, new_figure, save, write_table
from .plan import Plan
from .running import Runner

Floats = NDArray[np.float64]

EXAMPLES = ((0.0, 0.0, 90.0), (90.0, 0.0, 0.0), (10.0, 10.0, 10.0))  # degrees
# The paper states that "one of the corresponding line segments" was turned. Which angles that are can be read as:
CASES = {
    "one pair of 3 turned": np.arange(3) == 2,
    "every third pair of 12 turned": np.arange(12) % 3 == 2,
    "one segment of each of 10 pairs turned": np.ones(10, dtype=np.bool_),
}
STEPS = 37


def mitsuta(angles: ArrayLike, *, as_printed: bool = False) -> Floats:
    """Average angles of equal weights by Alg. 1.

    Parameters
    ----------
    angles : (..., n)
        Radians.
    as_printed : bool
        Add the differences in lines 15 and 16, as is printed, and not the angles that they lead to.

    Returns
    -------
    (...)
        Radians, not wrapped.
    """
    rows = np.asarray(angles, dtype=np.float64)
    old = rows[..., 0].copy()
    total = old.copy()
    for k in range(1, rows.shape[-1]):
        delta = rows[..., k] - old
        delta = np.where(delta < -math.pi, delta + math.tau, np.where(delta > math.pi, delta - math.tau, delta))
        old += delta
        total += delta if as_printed else old
    return np.asarray(total / rows.shape[-1], dtype=np.float64)


def wahba(angles: ArrayLike) -> Floats:
    """Average angles (..., n) of equal weights by Eq. (15); radians."""
    rows = np.asarray(angles, dtype=np.float64)
    return np.asarray(np.arctan2(np.sin(rows).sum(axis=-1), np.cos(rows).sum(axis=-1)), dtype=np.float64)


def examples() -> list[tuple[str, float, float, float]]:
    """Return the means of the examples: Mitsuta's, the same as printed, Wahba's; degrees."""
    rows = []
    for example in EXAMPLES:
        angles = np.radians(example)
        means = mitsuta(angles), mitsuta(angles, as_printed=True), wahba(angles)
        right, as_printed, by_wahba = (float(np.degrees(mean)) for mean in means)
        rows.append((str([round(a) for a in example]), right, as_printed, by_wahba))
    return rows


def spread(limits: Floats, draws: int, rng: np.random.Generator, turned: NDArray[np.bool_]) -> dict[str, Floats]:
    """Turn some of n equal angles by uniform noise and average all.

    Parameters
    ----------
    limits : (k,)
        Half widths of the interval of the noise, radians.
    draws : int
        Averages for each.
    rng : numpy.random.Generator
    turned : (n,)
        Which of the angles, in the order in which they are averaged.

    Returns
    -------
    dict
        Standard deviations of the means, (k,) radians, by name; and the excess kurtosis of Mitsuta's, 0 for a normal
        distribution.
    """
    noise = np.where(turned, rng.uniform(-1.0, 1.0, (draws, len(turned))), 0.0)
    found: dict[str, list[float]] = {"Mitsuta": [], "Wahba": [], "Mitsuta as printed": [], "kurtosis": []}
    for limit in limits:
        right = mitsuta(limit * noise)
        variance = float(np.mean(right**2))
        found["Mitsuta"].append(math.sqrt(variance))
        found["Wahba"].append(float(np.sqrt(np.mean(wahba(limit * noise) ** 2))))
        found["Mitsuta as printed"].append(float(np.sqrt(np.mean(mitsuta(limit * noise, as_printed=True) ** 2))))
        found["kurtosis"].append(float(np.mean(right**4)) / variance**2 - 3.0)
    return {name: np.array(values) for name, values in found.items()}


def mean_angles(plan: Plan, runner: Runner, out: Path) -> None:
    """Write both."""
    write_table(out / "sec45_means.csv", ("angles", "mitsuta", "mitsuta_as_printed", "wahba"), examples())
    limits = np.radians(np.linspace(0.0, 180.0, STEPS)[1:])
    rng = np.random.default_rng(plan.seed)
    found = runner.alone(
        "means of angles", lambda turned: spread(limits, plan.draws, rng, turned), list(CASES.values())
    )
    rows: list[Sequence[Cell]] = []
    figure = new_figure(10.0, 3.6)
    for axes, title, spreads in zip(figure.subplots(1, 3), CASES, found, strict=True):
        for name, colour in (("Mitsuta", GREEN), ("Wahba", INK)):
            axes.plot(np.degrees(limits), np.degrees(spreads[name]), "-", color=colour, lw=1.8, label=name)
        axes.set(title=title, xlabel="greatest noise, ± degrees")
        axes.set_xticks(range(0, 181, 30))
        axes.legend(loc="upper left")
        for k, limit in enumerate(limits):
            deviations = (float(np.degrees(spreads[n][k])) for n in ("Mitsuta", "Wahba", "Mitsuta as printed"))
            rows.append([title, float(np.degrees(limit)), *deviations, float(spreads["kurtosis"][k])])
    figure.axes[0].set_ylabel("deviation of the mean, degrees")
    head = ("case", "greatest_noise", "mitsuta", "wahba", "mitsuta_as_printed", "excess_kurtosis_of_mitsuta")
    write_table(out / "fig10_means.csv", head, rows)
    save(figure, out / "fig10_means.png")
