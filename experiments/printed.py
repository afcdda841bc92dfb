"""The paper's equations as they are printed, to see what they give; nothing else uses them.

What is wrong with each is reported in the docstrings; `registration.sums` has them right.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from registration import Correspondences, MeasuredSegments, RigidTransform, Segments, wrap_angle

from .mean_angles import mitsuta
from .measuring import Setup, take
from .output import BLUE, GREY, VERMILION, Cell, bars, new_figure, save, write_table
from .plan import Plan
from .running import Runner
from .scenes import NAMES, UNIT, poses, world

Floats = NDArray[np.float64]

POINTS, SIGMA = 300, 3.0
SCANS = 5
READINGS = ("corrected", "Eq. 1", "Eq. 8", "Eqs. 1 and 8", "Alg. 1", "Eq. 15")


@dataclass(frozen=True, slots=True)
class Reading:
    """Which of the misprints are followed.

    Attributes
    ----------
    eq1 : bool
        ``P = (p_D - p_S) n_S`` in place of ``(p_S - p_D) n_S``: the translation comes out with the other sign.
    eq8 : bool
        Minus in D1 and D2, where the solution of Eq. (6) has plus.
    alg1 : bool
        ``S += w delta`` in place of ``S += w alpha_old``: of equal angles the mean is one n-th.
    eq15 : bool
        The left normal, as in Eq. (1), where only the right-hand one holds: the angle comes out with the other sign.
    """

    eq1: bool = False
    eq8: bool = False
    alg1: bool = False
    eq15: bool = False


FOLLOWED = dict(
    zip(
        READINGS,
        (
            Reading(),
            Reading(eq1=True),
            Reading(eq8=True),
            Reading(eq1=True, eq8=True),
            Reading(alg1=True),
            Reading(eq15=True),
        ),
        strict=True,
    )
)


def translation(pairs: Correspondences, reading: Reading) -> Floats:
    """Solve Eqs. (5) to (8), all weights 1: (2,) metres."""
    v, n = pairs.map_directions, pairs.map_normals
    gaps = pairs.map_offsets - pairs.offsets
    x, y = ((-gaps if reading.eq1 else gaps)[:, None] * n).sum(axis=0)
    sx2, sy2, sxy = (v[:, 0] ** 2).sum(), (v[:, 1] ** 2).sum(), (v[:, 0] * v[:, 1]).sum()
    sign = -1.0 if reading.eq8 else 1.0
    solution = np.array([x * sx2 + sign * sxy * y, y * sy2 + sign * sxy * x])
    return np.asarray(solution / (sx2 * sy2 - sxy**2), dtype=np.float64)


def rotation(pairs: Correspondences, reading: Reading) -> float:
    """Average the angles by Alg. 1, or by Eq. (15); all weights 1, radians."""
    if reading.eq15:
        d, s = pairs.directions, pairs.map_directions
        across = np.einsum("ij,ij->i", pairs.map_normals, d).sum()
        return float(np.arctan2(across, np.einsum("ij,ij->i", s, d).sum()))
    return wrap_angle(float(mitsuta(pairs.angles(0.0), as_printed=reading.alg1)))


def ambiguity(pairs: Correspondences, at: Floats, *, as_printed: bool) -> float:
    """Return ``A_t / k_t`` at a translation: Eq. (19) as printed, or in the form that holds everywhere; metres^2."""
    v, n = pairs.map_directions, pairs.map_normals
    points = (pairs.map_offsets - pairs.offsets)[:, None] * n
    x, y = at
    constant = ((points[:, 0] * v[:, 1] - points[:, 1] * v[:, 0]) ** 2).sum()
    square = (x * v[:, 1] - y * v[:, 0]) ** 2
    if as_printed:
        return float(constant - square.sum())
    return float(constant + square.sum() - 2.0 * (at @ points.sum(axis=0)))


def _measure(job: tuple[str, int]) -> dict[str, list[tuple[float, float]]]:
    """Return the errors of each reading over scans of an environment, units and degrees."""
    name, seed = job
    rng, segments = np.random.default_rng([seed, NAMES.index(name)]), world(name).segments
    off: dict[str, list[tuple[float, float]]] = {reading: [] for reading in READINGS}
    for pose in poses(name):
        for _ in range(SCANS):
            scan = take(world(name), pose, (POINTS, SIGMA), Setup(), rng)
            pairs = Correspondences.of(segments, scan.measured, scan.pairs)
            for title, reading in FOLLOWED.items():
                x, y = translation(pairs, reading) - [pose.x, pose.y]
                turn = wrap_angle(rotation(pairs, reading) - pose.theta)
                off[title].append((float(np.hypot(x, y)) / UNIT, abs(float(np.degrees(turn)))))
    return off


def exact_case() -> tuple[Correspondences, RigidTransform]:
    """Return the pairs of an exact scan of CutSquare, and the pose that it was taken from."""
    segments, truth = world("CutSquare").segments, RigidTransform(1.2, 1.5, 0.6)
    back = truth.inverse().apply(segments.endpoints.reshape(-1, 2, 2)).reshape(-1, 4)
    scan = MeasuredSegments.from_segments(Segments.from_array(back))
    pairs = Correspondences.of(segments, scan, np.repeat(np.arange(len(segments)), 2).reshape(-1, 2))
    return pairs, truth


def exact_poses() -> list[Sequence[Cell]]:
    """Return the poses that each reading gives of the exact case, units and degrees, after the truth."""
    pairs, truth = exact_case()
    rows: list[Sequence[Cell]] = [["truth", truth.x / UNIT, truth.y / UNIT, float(np.degrees(truth.theta))]]
    for title, reading in FOLLOWED.items():
        x, y = translation(pairs, reading) / UNIT
        rows.append([title, float(x), float(y), float(np.degrees(rotation(pairs, reading)))])
    return rows


def exact_ambiguities() -> list[Sequence[Cell]]:
    """Return ``A_t`` by Eq. (19) as printed and in the form that holds everywhere, units^2, at three translations."""
    pairs, truth = exact_case()
    optimum = np.array([truth.x, truth.y])
    places = {"T = 0": np.zeros(2), "optimum": optimum, "10 units off": optimum + np.array([10.0 * UNIT, 0.0])}
    return [
        [name, *(round(ambiguity(pairs, at, as_printed=p) / UNIT**2, 6) + 0.0 for p in (True, False))]
        for name, at in places.items()
    ]


def printed(plan: Plan, runner: Runner, out: Path) -> None:
    """Write what each misprint does to an exact scan and to noisy ones."""
    write_table(out / "printed_exact.csv", ("followed", "x", "y", "heading"), exact_poses())
    write_table(out / "printed_ambiguity.csv", ("at", "as_printed", "corrected"), exact_ambiguities())
    done = runner.map("equations as printed", _measure, [(name, plan.seed) for name in NAMES])
    table = {
        (name, title): np.sqrt(np.mean(np.square(off[title]), axis=0))
        for name, off in zip(NAMES, done, strict=True)
        for title in READINGS
    }
    rows: list[Sequence[Cell]] = [[name, title, *(float(v) for v in value)] for (name, title), value in table.items()]
    write_table(out / "printed.csv", ("environment", "followed", "rms_position", "rms_heading_degrees"), rows)
    figure = new_figure(10.0, 5.4)
    for k, (axes, what) in enumerate(zip(figure.subplots(2, 1), ("position, units", "heading, degrees"), strict=True)):
        columns = {name: [float(table[name, t][k]) for t in READINGS] for name in NAMES}
        colours = zip(NAMES, (BLUE, GREY, VERMILION), strict=True)
        bars(axes, READINGS, [(name, columns[name], colour) for name, colour in colours], ".3g")
        axes.set_yscale("log")
        axes.set_title(f"RMS error of the {what}; followed as printed:")
        axes.margins(y=0.2)
    axes.legend(loc="upper left")
    save(figure, out / "printed.png")
