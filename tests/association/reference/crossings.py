"""Twins of the kernels that list crossings, and find which of them fit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from association.tuning import MIN_CROSSING
from registration.layout import Record, Records

from .geometry import point
from .proposing import end_slack

Ends = tuple[float, float, float, float]  # begin and end of the first run, and of the second, from where they cross


def crossings(runs: Records, reach: float) -> list[tuple[tuple[int, int], float, Ends]]:
    """Cross the lines of every two runs: the pair, the second turned to the left, the angle and the ends."""
    found = []
    for i, j in itertools.permutations(range(len(runs)), 2):
        p, q = runs[i], runs[j]
        d, e = np.array([p["dx"], p["dy"]]), np.array([q["dx"], q["dy"]])
        sine = d[0] * e[1] - d[1] * e[0]
        if sine < MIN_CROSSING:
            continue
        at = np.linalg.solve([[-d[1], d[0]], [-e[1], e[0]]], [p["offset"], q["offset"]])
        ends = (p["begin"] - at @ d, p["end"] - at @ d, q["begin"] - at @ e, q["end"] - at @ e)
        if max(ends[0], -ends[1], ends[2], -ends[3]) <= reach:
            found.append(((i, j), math.atan2(sine, d @ e), ends))
    return found


def ends_at(a: Record, b: Record, gap: float) -> Ends:
    """Return where two runs have to begin and end, from where they cross, if a base is to lie on them, turned by `gap`.

    The segments are turned as `base_pose` turns them, and the lines go through their midpoints.
    """
    turn = gap * a["angle_variance"] / (a["angle_variance"] + b["angle_variance"])
    first, second = a["angle"] - turn, b["angle"] + gap - turn
    d, e = np.array([math.cos(first), math.sin(first)]), np.array([math.cos(second), math.sin(second)])
    along = np.linalg.solve(np.stack([d, -e], axis=1), point(b) - point(a))
    half = [0.5 * one["length"] - end_slack(one["length"]) for one in (a, b)]
    return (
        -along[0] - half[0],
        -along[0] + half[0],
        -along[1] - half[1],
        -along[1] + half[1],
    )


def fitting(rows: Records, corner: Sequence[float]) -> list[int]:
    """Look at every crossing."""
    low, high, first_begin, first_end, second_begin, second_end = corner
    fits = (
        (rows["angle"] >= low) & (rows["angle"] <= high)
        & (rows["first_begin"] <= first_begin) & (rows["first_end"] >= first_end)
        & (rows["second_begin"] <= second_begin) & (rows["second_end"] >= second_end)
    )  # fmt: skip
    found: list[int] = np.flatnonzero(fits).tolist()
    return found
