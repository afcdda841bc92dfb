"""Time to add one pair to the sums of N others, and to sum all of them again (Sec. 3.5)."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from registration import Correspondences, JointSums, MeasuredSegments, OneStepSums, RigidTransform, Segments

from .output import BLUE, ORANGE, Cell, new_figure, save, write_table
from .plan import Plan
from .running import Runner

ESTIMATORS = ("one_step", "joint")
PATIENCE = 0.05  # s of processor time that a measurement may take, one call at least
MOST_CALLS = 300


def drawn_pairs(count: int, rng: np.random.Generator, truth: RigidTransform, spread: float = 10.0) -> Correspondences:
    """Return pairs of segments of 2 m that fit exactly, middles within `spread` metres of the sensor."""
    middles, angles = rng.uniform(-spread, spread, (count, 2)), rng.uniform(-math.pi, math.pi, count)
    half = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    scan = Segments.from_array(np.hstack([middles - half, middles + half]))
    map = Segments.from_array(truth.apply(scan.endpoints.reshape(-1, 2, 2)).reshape(-1, 4))
    rows = np.repeat(np.arange(count), 2).reshape(-1, 2)
    return Correspondences.of(map, MeasuredSegments.from_segments(scan), rows)


def _microseconds(action: Callable[[], object]) -> float:
    """Return the processor time of the fastest of some calls, the others being disturbed."""
    action()
    times: list[float] = []
    while len(times) < MOST_CALLS and sum(times) < PATIENCE:
        start = time.thread_time()
        action()
        times.append(time.thread_time() - start)
    return 1e6 * min(times)


def _time(job: tuple[int, int]) -> dict[tuple[str, str], float]:
    """Time all steps over the sums of so many pairs."""
    count, seed = job
    pairs = drawn_pairs(count + 1, np.random.default_rng(seed), RigidTransform(3.0, -2.0, 0.7))
    others, weights = pairs.take(slice(0, count)), np.full(count, 1e4)
    joint, one_step = JointSums.of_set(others, weights), OneStepSums.of_set(others, weights)
    return {
        ("joint", "add one"): _microseconds(lambda: joint.add(pairs, count, 1e4)),
        ("joint", "remove one"): _microseconds(lambda: joint.remove(pairs, 0, 1e4)),
        ("joint", "add a set"): _microseconds(lambda: joint + joint),
        ("joint", "solve"): _microseconds(lambda: joint.solve(0.7)),
        ("joint", "sum anew"): _microseconds(lambda: JointSums.of_set(others, weights)),
        ("one_step", "add one"): _microseconds(lambda: one_step.add(pairs, count, 1e4)),
        ("one_step", "remove one"): _microseconds(lambda: one_step.remove(pairs, 0, 1e4)),
        ("one_step", "add a set"): _microseconds(lambda: one_step + one_step),
        ("one_step", "solve"): _microseconds(lambda: one_step.solve("mitsuta")),
        ("one_step", "sum anew"): _microseconds(lambda: OneStepSums.of_set(others, weights)),
    }


def constant_time(plan: Plan, runner: Runner, out: Path) -> None:
    """Write the times."""
    done = runner.alone("time of adding a pair", _time, [(count, plan.seed) for count in plan.counts])
    steps = ("add one", "remove one", "add a set", "solve", "sum anew")
    rows: list[Sequence[Cell]] = [
        [estimator, count, *(found[estimator, step] for step in steps)]
        for estimator in ESTIMATORS
        for count, found in zip(plan.counts, done, strict=True)
    ]
    write_table(out / "constant_time.csv", ("estimator", "pairs", *(f"{s}, microseconds" for s in steps)), rows)
    figure = new_figure(10.0, 3.6)
    for axes, estimator in zip(figure.subplots(1, 2, sharey=True), ESTIMATORS, strict=True):
        for step, style, colour in (("add one", "-o", BLUE), ("solve", ":", BLUE), ("sum anew", "-s", ORANGE)):
            axes.loglog(plan.counts, [found[estimator, step] for found in done], style, ms=4, color=colour, label=step)
        axes.set(title=estimator, xlabel="pairs in the sums", ylabel="processor time, µs")
        axes.legend(loc="upper left")
    save(figure, out / "constant_time.png")
