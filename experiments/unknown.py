"""The same poses without correspondences: the search, and the iterative closest point method from growing errors."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from association import MapIndex, Scan, associate
from registration import RigidTransform, register, wrap_angle

from .icp import align
from .measuring import Measurement, Setup, take
from .output import BLUE, GREEN, Cell, bars, new_figure, save, write_table
from .plan import Plan
from .running import Runner
from .scenes import NAMES, UNIT, bound, poses, world

CONDITIONS = ((300, 1.0), (300, 3.0), (300, 5.0), (300, 10.0), (1000, 10.0))
BASIN = (300, 5.0)
NEAR, TURNED = 25.0, 5.0  # units and degrees; an answer this near to the truth has found the place
FARTHEST, MOST_TURNED = 200.0, 180.0  # units and degrees, of the errors that ICP starts with
METHODS = ("associate", "joint, known", "ICP from the truth")


@dataclass(frozen=True, slots=True)
class Found:
    """One scan, registered three ways.

    Attributes
    ----------
    errors : method: (units, radians), nan where there was no answer
    bounds : (float, float)
        Variances of position and heading that no estimator with known correspondences beats.
    usable : bool
        Verdict of the search.
    milliseconds : (float, float)
        Processor time of search and ICP.
    """

    errors: dict[str, tuple[float, float]]
    bounds: tuple[float, float]
    usable: bool
    milliseconds: tuple[float, float]


@cache
def _index(name: str) -> MapIndex:
    return MapIndex.build(world(name).segments)


def found_place(error: tuple[float, float]) -> bool:
    """Tell whether an error in units and radians is that of the right place."""
    return error[0] <= NEAR and error[1] <= math.radians(TURNED)


def _error(pose: RigidTransform | None, truth: RigidTransform) -> tuple[float, float]:
    if pose is None:
        return math.nan, math.nan
    return math.hypot(pose.x - truth.x, pose.y - truth.y) / UNIT, abs(wrap_angle(pose.theta - truth.theta))


def search(name: str, scan: Measurement) -> tuple[RigidTransform | None, bool]:
    """Search for a scan anywhere in its environment: the pose and whether it is usable."""
    if scan.found is None:
        raise ValueError("the search takes a vectorized scan")
    answer = associate(_index(name), Scan(scan.measured, (0.0, 0.0), scan.found.beams))
    return answer.pose, answer.usable


def _locate(job: tuple[str, tuple[int, float], int, int]) -> list[Found]:
    name, condition, scans, seed = job
    segments, out = world(name).segments, []
    rng = np.random.default_rng([seed, NAMES.index(name), condition[0], round(condition[1])])
    for k, truth in enumerate(poses(name)):
        covariance = bound(name, truth, *condition)
        for j in range(scans):
            scan = take(world(name), truth, condition, Setup(), rng)
            if k == j == 0:
                search(name, scan)  # compiled and cached before the clock starts
            times = [time.thread_time()]
            pose, usable = search(name, scan)
            times.append(time.thread_time())
            aligned = align(scan.points, segments, truth).pose
            times.append(time.thread_time())
            known = register(segments, scan.measured, scan.pairs)
            answers = pose, None if known.degenerate else known.pose, aligned
            errors = {method: _error(answer, truth) for method, answer in zip(METHODS, answers, strict=True)}
            search_ms, icp_ms = (float(t) for t in 1e3 * np.diff(times))
            bounds = float(covariance[0, 0] + covariance[1, 1]), float(covariance[2, 2])
            out.append(Found(errors, bounds, usable, (search_ms, icp_ms)))
    return out


def unknown(plan: Plan, runner: Runner, out: Path) -> None:
    """Search for scans of all environments; write how often the place is found, and how well."""
    jobs = [(name, condition, plan.search_scans, plan.seed) for name in NAMES for condition in CONDITIONS]
    rows: list[Sequence[Cell]] = []
    shares: dict[tuple[str, int, float], tuple[float, float, float]] = {}
    done = runner.map("search, unknown correspondences", _locate, jobs)
    for (name, condition, *_), found in zip(jobs, done, strict=True):
        right = [found_place(f.errors["associate"]) for f in found]
        wrong = sum(f.usable and not r for f, r in zip(found, right, strict=True))
        usable = float(np.mean([f.usable for f in found]))
        icp = float(np.mean([found_place(f.errors["ICP from the truth"]) for f in found]))
        shares[name, *condition] = float(np.mean(right)), usable, icp
        over = [v for method in METHODS for v in _over_bound(found, method)]
        times = [float(np.median([f.milliseconds[k] for f in found])) for k in range(2)]
        rows.append([name, *condition, len(found), float(np.mean(right)), usable, wrong, icp, *over, *times])
    head = (
        "environment", "points", "sigma", "scans", "right", "usable", "usable_but_wrong", "icp_right",
        *(f"{method}: {what} over bound" for method in METHODS for what in ("position", "heading")),
        "search_ms", "icp_ms",
    )  # fmt: skip
    write_table(out / "unknown.csv", head, rows)
    figure = new_figure(10.0, 3.4)
    for axes, name in zip(figure.subplots(1, 3, sharey=True), NAMES, strict=True):
        own = [shares[name, *c] for c in CONDITIONS]
        series = [(label, [100.0 * o[k] for o in own], colour)
                  for k, (label, colour) in enumerate((("right", GREEN), ("usable", BLUE)))]  # fmt: skip
        bars(axes, [f"{p}\n{s:g}" for p, s in CONDITIONS], series, ".0f")
        axes.set(title=name, xlabel="points per scan, and σ", ylim=(0, 118))
    figure.axes[0].set_ylabel("search without a guess, % of scans")
    axes.legend(loc="upper right", ncols=2)
    save(figure, out / "unknown.png")


def _over_bound(found: Sequence[Found], method: str) -> tuple[float, float]:
    """Return root mean square errors over the bound's, of the scans whose place was found."""
    right = [f for f in found if found_place(f.errors[method])]
    if not right:
        return math.nan, math.nan
    ratios = [
        math.sqrt(sum(f.errors[method][k] ** 2 for f in right) / sum(f.bounds[k] for f in right)) for k in range(2)
    ]
    return ratios[0], ratios[1]


def _basin(job: tuple[str, float, float, int, int]) -> tuple[float, float]:
    """Start ICP off the truth by a distance in any direction and an angle either way; return how often it comes home.

    The same for the search, which does not use the start.
    """
    name, distance, angle, scans, seed = job
    rng = np.random.default_rng([seed, NAMES.index(name), 77])
    home, searched = [], []
    for truth in poses(name):
        for _ in range(scans):
            scan = take(world(name), truth, BASIN, Setup(), rng)
            bearing, side = rng.uniform(-math.pi, math.pi), rng.choice([-1.0, 1.0])
            start = RigidTransform(
                truth.x + distance * UNIT * math.cos(bearing),
                truth.y + distance * UNIT * math.sin(bearing),
                truth.theta + side * math.radians(angle),
            )
            home.append(found_place(_error(align(scan.points, world(name).segments, start).pose, truth)))
            if distance == angle == 0.0:
                searched.append(found_place(_error(search(name, scan)[0], truth)))
    return float(np.mean(home)), float(np.mean(searched)) if searched else math.nan


def basin(plan: Plan, runner: Runner, out: Path) -> None:
    """Write how far off ICP may start."""
    distances = np.linspace(0.0, FARTHEST, plan.basin_steps)
    angles = np.linspace(0.0, MOST_TURNED, plan.basin_steps)
    starts = [(float(d), float(a)) for a in angles for d in distances]
    jobs = [(name, *start, plan.basin_scans, plan.seed) for name in NAMES for start in starts]
    done = runner.map("ICP from growing errors", _basin, jobs)
    rows: list[Sequence[Cell]] = [[*job[:3], *result] for job, result in zip(jobs, done, strict=True)]
    write_table(out / "basin.csv", ("environment", "distance", "degrees", "icp_right", "search_right"), rows)
    figure = new_figure(10.0, 4.0)
    shape = len(NAMES), len(angles), len(distances)
    shares = np.array([d[0] for d in done]).reshape(shape)
    searched = np.array([d[1] for d in done]).reshape(shape)[:, 0, 0]
    for axes, name, cells, share in zip(figure.subplots(1, 3, sharey=True), NAMES, shares, searched, strict=True):
        drawn = axes.imshow(cells, origin="lower", vmin=0.0, vmax=1.0, cmap="Greens", aspect="auto")
        for (row, column), value in np.ndenumerate(cells):
            axes.text(column, row, f"{100 * value:.0f}", ha="center", va="center", fontsize=6.5,
                      color="white" if value > 0.6 else "black")  # fmt: skip
        axes.set_xticks(range(len(distances)), [f"{d:.0f}" for d in distances])
        axes.set_yticks(range(len(angles)), [f"{a:.0f}" for a in angles])
        axes.grid(visible=False)
        axes.set(title=f"{name}: ICP right, %\nsearch, without a start: {100 * share:.0f} %")
        axes.set_xlabel("start off by, units")
        axes.set_ylabel("and turned by, degrees" if axes is figure.axes[0] else "")
    figure.colorbar(drawn, ax=figure.axes, shrink=0.8, ticks=[0, 0.5, 1], format="%.1f")
    save(figure, out / "basin.png")
