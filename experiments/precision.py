"""The paper's note on stability: float32 for the segments and float64 for the sums, against float64 for all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import DTypeLike, NDArray

from registration import Correspondences, RigidTransform

from .constant_time import drawn_pairs
from .output import BLUE, ORANGE, VERMILION, Cell, new_figure, save, write_table
from .plan import Plan
from .running import Runner

Floats = NDArray[np.float64]

KINDS: dict[str, tuple[DTypeLike, DTypeLike]] = {
    "float32 parameters and sums": (np.float32, np.float32),
    "float32 parameters, float64 sums": (np.float32, np.float64),
    "float64 parameters and sums": (np.float64, np.float64),
}
OFFSETS = (0.0, 1_000.0, 100_000.0)  # m from the map's origin to the scene
HEADING = 0.7
REPEATS = 5


def translation(pairs: Correspondences, parameters: DTypeLike, sums: DTypeLike) -> Floats:
    """Solve Eqs. (1) to (8) with segments and running sums of given types; (2,) metres.

    As an implementation does that keeps endpoint and direction of each segment: the offsets are worked out in the
    parameters' type, and every term is added to a variable of the sums' type, one after the other.
    """
    v, d = pairs.map_directions.astype(parameters), pairs.directions.astype(parameters)
    on_map, on_scan = pairs.map_midpoints.astype(parameters), pairs.midpoints.astype(parameters)
    map_offsets = -v[:, 1] * on_map[:, 0] + v[:, 0] * on_map[:, 1]
    scan_offsets = -d[:, 1] * on_scan[:, 0] + d[:, 0] * on_scan[:, 1]
    gaps = map_offsets - scan_offsets
    terms = (v[:, 0] ** 2, v[:, 1] ** 2, v[:, 0] * v[:, 1], -gaps * v[:, 1], gaps * v[:, 0])
    # A cumulative sum adds one by one; numpy's sum would add in pairs and lose less.
    sx2, sy2, sxy, px, py = (float(np.cumsum(t, dtype=sums)[-1]) for t in terms)
    det = sx2 * sy2 - sxy**2
    return np.array([px * sx2 + sxy * py, py * sy2 + sxy * px]) / det


def _lost(job: tuple[int, float, int]) -> dict[str, float]:
    """Return what rounding alone puts the pose off by, root mean square over some scenes, metres."""
    count, offset, seed = job
    truth = RigidTransform(offset + 3.0, 0.7 * offset - 2.0, HEADING)
    squares: dict[str, list[float]] = {kind: [] for kind in KINDS}
    for repeat in range(REPEATS):
        pairs = drawn_pairs(count, np.random.default_rng([seed, repeat]), truth)
        for kind, types in KINDS.items():
            x, y = translation(pairs, *types) - [truth.x, truth.y]
            squares[kind].append(float(x**2 + y**2))
    return {kind: float(np.sqrt(np.mean(values))) for kind, values in squares.items()}


def precision(plan: Plan, runner: Runner, out: Path) -> None:
    """Write what each choice of types loses."""
    jobs = [(count, offset, plan.seed) for offset in OFFSETS for count in plan.counts]
    done = runner.map("float32 and float64", _lost, jobs)
    rows: list[Sequence[Cell]] = [
        [offset, count, *found.values()] for (count, offset, _), found in zip(jobs, done, strict=True)
    ]
    write_table(out / "precision.csv", ("metres_from_origin", "pairs", *KINDS), rows)
    figure = new_figure(10.0, 3.6)
    for axes, offset in zip(figure.subplots(1, 3, sharey=True), OFFSETS, strict=True):
        own = [found for (_, o, _), found in zip(jobs, done, strict=True) if o == offset]
        for kind, colour, mark in zip(KINDS, (VERMILION, ORANGE, BLUE), "os^", strict=True):
            axes.loglog(plan.counts, [max(f[kind], 1e-17) for f in own], "-" + mark, ms=4, color=colour, label=kind)
        axes.set(title=f"{offset / 1000:g} km from the map's origin", xlabel="pairs")
    figure.axes[0].set_ylabel("position off by rounding alone, m")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    save(figure, out / "precision.png")
