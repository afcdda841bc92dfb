"""Lines of several views are paired as their reference pairs them."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given, settings

from association.layout import LINE_PARTS, POINT, as_records
from association.scan.kernels.alignment import pair_lines
from association.scan.tuning import ALIGNED_VIEWS, GATE_SIGMAS, LEAST_ALIGNED, MOST_APART, MOST_TURNED, SAME_LINE
from association.tuning import MODEL_ANGLE, ROUGHNESS
from registration.layout import Floats, Record, Records

from ...kernels.drawn import SEEDS


def direction(line: Record) -> Floats:
    return np.array([line["dx"], line["dy"]])


def normal(line: Record) -> Floats:
    return np.array([-line["dy"], line["dx"]])


def centroid(line: Record) -> Floats:
    return np.array([line["centroid_x"], line["centroid_y"]])


def middle(line: Record) -> Floats:
    return np.array([line["x"], line["y"]])


def could_be_one(
    one: Record, other: Record, views: tuple[int, int], places: Floats, covariance: Floats
) -> tuple[float, float] | None:
    """Return the offset of two lines and that over its noise where they may be one; None where they cannot."""
    d, n = direction(other), normal(other)
    sine, cosine = float(n @ direction(one)), float(d @ direction(one))
    if abs(sine) > MOST_TURNED or cosine <= 0.0:
        return None
    ends = [d @ (middle(one) + sign * 0.5 * one["length"] * d - middle(other)) for sign in (-1.0, 1.0)]
    low, high = max(ends[0], -0.5 * other["length"]), min(ends[1], 0.5 * other["length"])
    if high - low < min(LEAST_ALIGNED, 0.5 * min(one["length"], other["length"])):
        return None
    at = middle(other) + 0.5 * (low + high) * d
    along = [float(direction(line) @ (at - centroid(line))) for line in (one, other)]
    offset = float(n @ (centroid(one) + along[0] * direction(one) - at))
    noise = sum(
        ROUGHNESS**2 + line["variance"] * (1.0 + a * a / line["spread"])
        for line, a in zip((one, other), along, strict=True)
    )
    turning = sum(MODEL_ANGLE**2 + line["variance"] / line["spread"] for line in (one, other))
    g, turn = np.zeros(len(covariance)), np.zeros(len(covariance))
    for v, sign in zip(views, (1.0, -1.0), strict=True):
        lever = at - places[v]
        g[3 * v : 3 * v + 3] = sign * np.array([*n, n @ [-lever[1], lever[0]]])
        turn[3 * v + 2] = sign
    near = abs(offset) <= min(MOST_APART, GATE_SIGMAS * math.sqrt(noise + g @ covariance @ g))
    if not near or abs(sine) > GATE_SIGMAS * math.sqrt(turning + turn @ covariance @ turn):
        return None
    return offset, abs(offset) / math.sqrt(noise)


def twin(lines: Records, of_view: list[int], places: Floats, covariance: Floats) -> list[list[int]]:
    """Pair each line with the best of the nearest view before its own in which only one wall can be it."""
    pairs = []
    for i, v in enumerate(of_view):
        for u in range(v - 1, max(-1, v - 1 - ALIGNED_VIEWS), -1):
            may = {
                j: found
                for j, w in enumerate(of_view)
                if w == u and (found := could_be_one(lines[i], lines[j], (v, u), places, covariance)) is not None
            }
            offsets = [offset for offset, _ in may.values()]
            if may and max(offsets) - min(offsets) <= SAME_LINE:
                pairs.append([i, min(may, key=lambda j: may[j][1])])
                break
    return pairs


@given(SEEDS)
@settings(max_examples=60, deadline=None)
def test_pair_lines(seed: int) -> None:
    """Walls seen by some of three views each, off by what the views are off, and others that are near."""
    rng = np.random.default_rng(seed)
    places, root = rng.normal(size=(3, 2)), rng.normal(size=(9, 6)) * 0.03
    root[:3] = 0.0
    shifts = (root @ rng.normal(size=6)).reshape(3, 3)
    drawn: list[list[tuple[float, ...]]] = [[], [], []]
    for _ in range(6):
        angle, x, y = rng.choice([0.1, 1.7, 3.2]), *rng.uniform(-4.0, 4.0, 2)
        for v in np.flatnonzero(rng.random(3) < 0.8):
            turned = angle + shifts[v, 2] + rng.normal() * 0.01
            px, py = x + shifts[v, 0] + rng.normal() * 0.01, y + shifts[v, 1] + rng.normal() * 0.01
            drawn[v].append((math.cos(turned), math.sin(turned), px, py, rng.uniform(0.3, 4.0)))
    of_view = [v for v in range(3) for _ in drawn[v]]
    lines = np.zeros(len(of_view), LINE_PARTS)
    for line, row in zip(lines, [row for some in drawn for row in some], strict=True):
        line["dx"], line["dy"], line["x"], line["y"], line["length"] = row
        line["centroid_x"], line["centroid_y"] = row[2] + 0.1 * row[0], row[3] + 0.1 * row[1]
        line["spread"], line["variance"] = row[4] ** 2 / 12.0, 1e-5
    covariance, starts = root @ root.T, np.searchsorted(of_view, np.arange(4))
    got = pair_lines(lines, starts, as_records(POINT, places), covariance)
    assert got.tolist() == twin(lines, of_view, places, covariance)
