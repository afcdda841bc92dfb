"""Loss by the extraction of segments: the likelihood of all raw beams, whose walls are known."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from registration import RegistrationResult, RigidTransform, register, wrap_angle
from simulation import SimulatedScan

from .measuring import Setup, take
from .output import BLUE, GREY, ORANGE, SKY, Cell, bars, new_figure, save, write_table
from .plan import Plan
from .running import Runner
from .scenes import NAMES, UNIT, bound, expected_ranges, poses, world

Floats = NDArray[np.float64]
Pair = tuple[float, float]
Job = tuple[str, tuple[int, float], int, int]

NOTHING = math.nan, math.nan
CONDITIONS = ((300, 3.0), (300, 10.0), (1000, 3.0), (1000, 10.0))
STEPS = 10
SETUPS = {"vectorized": Setup(), "true corners": Setup(cut="walls")}
# The likelihood of all beams; then the joint estimator's errors, those of the scans that it calls usable (chi-square
# below its 99.9 % quantile), and what its covariance claims.
METHODS = (
    "all raw beams",
    *(f"{setup}: {what}" for setup in SETUPS for what in ("errors", "errors if usable", "claimed")),
)
SHOWN = {"all raw beams": GREY, "vectorized: errors": BLUE, "vectorized: errors if usable": SKY,
         "vectorized: claimed": ORANGE}  # fmt: skip


def most_likely(name: str, seen: SimulatedScan, start: RigidTransform) -> RigidTransform:
    """Fit the pose to all ranges by least squares, each beam's wall known: what the bound is the bound of."""
    finite = np.isfinite(seen.ranges)
    hits, angles, ranges = seen.hits[finite], seen.angles[finite], seen.ranges[finite]
    pose = start
    for _ in range(STEPS):
        expected, jacobian = expected_ranges(world(name).segments, hits, angles, pose)
        step = np.linalg.lstsq(jacobian, ranges - expected, rcond=None)[0]
        pose = RigidTransform(pose.x + float(step[0]), pose.y + float(step[1]), pose.theta + float(step[2]))
    return pose


def _ratios(job: Job) -> dict[str, tuple[float, float, float]]:
    """Return by method the root mean square over the bound, position and heading, and the share of scans in it."""
    name, condition, scans, seed = job
    rng = np.random.default_rng([seed, NAMES.index(name), condition[0], round(condition[1]), 5])
    squares: dict[str, list[Pair]] = {method: [] for method in METHODS}
    least: list[Pair] = []
    for pose in poses(name):
        covariance = bound(name, pose, *condition)
        for _ in range(scans):
            least.append((float(covariance[0, 0] + covariance[1, 1]), float(covariance[2, 2])))
            state = rng.bit_generator.state
            for setup, how in SETUPS.items():
                rng.bit_generator.state = state  # the same scan, cut another way
                scan = take(world(name), pose, condition, how, rng)
                found = register(world(name).segments, scan.measured, scan.pairs)
                square = _square(None if found.degenerate else found.pose, pose)
                squares[f"{setup}: errors"].append(square)
                squares[f"{setup}: errors if usable"].append(square if found.usable else NOTHING)
                squares[f"{setup}: claimed"].append(_claimed(found))
            squares["all raw beams"].append(_square(most_likely(name, scan.seen, pose), pose))
    return {method: _over(np.array(values), np.array(least)) for method, values in squares.items()}


def _over(squares: Floats, least: Floats) -> tuple[float, float, float]:
    there = np.isfinite(squares[:, 0])
    if not there.any():
        return math.nan, math.nan, 0.0
    position, heading = np.sqrt(squares[there].sum(axis=0) / least[there].sum(axis=0))
    return float(position), float(heading), float(there.mean())


def _claimed(found: RegistrationResult) -> Pair:
    c = found.covariance
    return NOTHING if c is None else (float(c[0, 0] + c[1, 1]) / UNIT**2, float(c[2, 2]))


def _square(found: RigidTransform | None, truth: RigidTransform) -> Pair:
    if found is None:
        return NOTHING
    distance = math.hypot(found.x - truth.x, found.y - truth.y) / UNIT
    return distance**2, wrap_angle(found.theta - truth.theta) ** 2


def raw_beams(plan: Plan, runner: Runner, out: Path) -> None:
    """Write errors over the bound with and without segments between."""
    jobs = [(name, condition, plan.test_scans, plan.seed) for name in NAMES for condition in CONDITIONS]
    done = runner.map("raw beams", _ratios, jobs)
    rows: list[Sequence[Cell]] = [
        [name, *condition, method, *ratio]
        for (name, condition, *_), ratios in zip(jobs, done, strict=True)
        for method, ratio in ratios.items()
    ]
    head = ("environment", "points", "sigma", "method", "position_over_bound", "heading_over_bound", "share_of_scans")
    write_table(out / "raw_beams.csv", head, rows)
    figure = new_figure(10.0, 3.4)
    labels = [f"{points}\n{sigma:g}" for points, sigma in CONDITIONS]
    for k, (axes, name) in enumerate(zip(figure.subplots(1, 3), NAMES, strict=True)):
        own = done[k * len(CONDITIONS) : (k + 1) * len(CONDITIONS)]
        series = [(method, [ratios[method][0] for ratios in own], colour) for method, colour in SHOWN.items()]
        bars(axes, labels, series, ".1f")
        axes.set(title=name, xlabel="points per scan, and σ")
        axes.axhline(1.0, color="black", lw=0.8)
    figure.axes[0].set_ylabel("position, RMS over the bound")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    save(figure, out / "raw_beams.png")
