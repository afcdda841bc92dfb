"""A scan with its segments and their known correspondences."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from registration import IDENTITY, MeasuredSegments, RigidTransform, Segments
from simulation import Scanner, SimulatedScan, World, scan
from vectorization import LaserScan, Vectorization, VectorizationOptions, vectorize

from .scenes import REACH, UNIT, Places

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Setup:
    """Settings of scans, of their segments, pairs and registration.

    The defaults are the experiment; other values test what its numbers depend on, for the paper does not say.

    Attributes
    ----------
    cut : "vectorizer" or "walls"
        By `vectorization`, or at the true ends of each wall with a plain total least squares line through its points.
    noise : "range" or "point"
        Gaussian noise of each range, or of both coordinates of each point.
    purity : float
        A segment corresponds to the wall that this share of its beams hit, or to none.
    min_length : float
        Shorter segments are left out, units.
    min_points : int
        Segments of fewer points are left out.
    origin : "sensor", "middle" or "map"
        Where the scan frame has its origin when the scan is registered: at the sensor, amid the scan's segments, or
        where the map has its own (the scan laid on the map by the true pose first).
    places : "path" or "scattered"
        Poses of the scans.
    """

    cut: Literal["vectorizer", "walls"] = "vectorizer"
    noise: Literal["range", "point"] = "range"
    purity: float = 0.9
    min_length: float = 10.0
    min_points: int = 4
    origin: Literal["sensor", "middle", "map"] = "sensor"
    places: Places = "path"


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """A scan.

    Attributes
    ----------
    measured : MeasuredSegments
        In the scan frame, metres.
    pairs : (n, 2)
        ``[scan segment, map segment]``.
    points : (k, 2)
        The raw points, metres.
    seen : SimulatedScan
        Ranges of the scanner.
    found : Vectorization or None
        Result of the vectorizer; None if it was not called.
    """

    measured: MeasuredSegments
    pairs: Indices
    points: Floats
    seen: SimulatedScan
    found: Vectorization | None

    def moved(self, by: RigidTransform) -> MeasuredSegments:
        """Return the segments in a frame that sees them moved."""
        s = self.measured
        if by == IDENTITY:
            return s
        ends = by.apply(s.segments.endpoints.reshape(-1, 2, 2)).reshape(-1, 4)
        moments = by.apply(s.centroids), s.spreads
        return MeasuredSegments.from_segments(Segments.from_array(ends), s.sigma, s.point_counts, moments)


def take(
    world: World, pose: RigidTransform, noise: tuple[int, float], setup: Setup, rng: np.random.Generator
) -> Measurement:
    """Scan a world and find the segments and their walls.

    Parameters
    ----------
    world : World
    pose : RigidTransform
        map_from_scan, metres.
    noise : (int, float)
        Points of the scan, and their standard deviation in units.
    setup : Setup
    rng : numpy.random.Generator
    """
    count, sigma = noise[0], noise[1] * UNIT
    by_range = setup.noise == "range"
    scanner = Scanner.over(math.tau, count, sigma=sigma if by_range else 0.0, range_max=REACH)
    seen = scan(world.segments, pose, scanner, rng)
    finite = np.isfinite(seen.ranges)
    hits, points = seen.hits[finite], seen.points
    if not by_range:
        points = points + rng.normal(0.0, sigma, points.shape)
    if setup.cut == "walls":
        measured, walls = _cut_at_walls(world.segments, pose, points, hits, (sigma, setup))
        return Measurement(measured, np.stack([np.arange(len(walls)), walls], axis=1), points, seen, None)
    options = VectorizationOptions(sigma=sigma, min_points=setup.min_points)
    found = vectorize(_laser(seen) if by_range else points, options)
    pairs = _pairs(found.spans, seen.hits if by_range else hits, setup.purity)
    return Measurement(found.measured, pairs[_kept(found.measured, setup)[pairs[:, 0]]], points, seen, found)


def _laser(seen: SimulatedScan) -> LaserScan:
    scanner = seen.scanner
    return LaserScan(scanner.angle_min, scanner.angle_increment, seen.ranges, scanner.range_min, scanner.range_max)


def _kept(measured: MeasuredSegments, setup: Setup) -> NDArray[np.bool_]:
    long_enough: NDArray[np.bool_] = measured.segments.lengths >= setup.min_length * UNIT
    return long_enough


def _pairs(beams: Indices, hits: Indices, purity: float) -> Indices:
    """Return the segments that lie on one wall, by what their beams hit, with that wall."""
    rows = []
    for k, (begin, end) in enumerate(beams):
        span = np.arange(begin, end + 1 if end >= begin else end + 1 + len(hits)) % len(hits)
        counts = np.bincount(hits[span][hits[span] >= 0])
        if len(counts) and counts.max() >= purity * counts.sum():
            rows.append((k, int(counts.argmax())))
    return np.array(rows, dtype=np.int64).reshape(-1, 2)


def _cut_at_walls(
    map: Segments, pose: RigidTransform, points: Floats, hits: Indices, how: tuple[float, Setup]
) -> tuple[MeasuredSegments, Indices]:
    """Fit a total least squares line to the points of every stretch of beams that hit one wall."""
    sigma, setup = how
    # Begin where a wall does, so that none is cut by the seam of the turn.
    shift = int(np.argmax(hits != np.roll(hits, 1)))
    points, hits = np.roll(points, -shift, axis=0), np.roll(hits, -shift)
    starts = np.flatnonzero(np.concatenate([[True], hits[1:] != hits[:-1]]))
    counts = np.diff([*starts, len(hits)])
    many = counts >= setup.min_points
    # The stretches of too few points are taken out first: two points have a line, one has none.
    kept = np.repeat(many, counts)
    points, walls, counts = points[kept], hits[starts[many]], counts[many]
    starts = np.concatenate([[0], np.cumsum(counts)[:-1]]).astype(np.int64)

    def means(values: Floats) -> Floats:
        return np.asarray(np.add.reduceat(values, starts) / counts)

    centroids = np.stack([means(points[:, 0]), means(points[:, 1])], axis=1)
    x, y = (points - np.repeat(centroids, counts, axis=0)).T
    angles = 0.5 * np.arctan2(2.0 * means(x * y), means(x * x) - means(y * y))
    directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    last = starts + counts - 1
    backward = directions[:, 0] * (x[last] - x[starts]) + directions[:, 1] * (y[last] - y[starts]) < 0.0
    directions[backward] *= -1.0
    of_point = np.repeat(directions, counts, axis=0)
    along = x * of_point[:, 0] + y * of_point[:, 1]
    ends = [centroids + along[k][:, None] * directions for k in (starts, last)]
    across = points[:, 1] * of_point[:, 0] - points[:, 0] * of_point[:, 1]
    incidence = np.sqrt(means(across**2 / (points**2).sum(axis=1)))
    sigmas = sigma * incidence if setup.noise == "range" else np.full(len(counts), sigma)
    good = along[last] - along[starts] >= max(1e-3, setup.min_length * UNIT)
    moments = centroids[good], means(along**2)[good]
    segments = Segments.from_array(np.hstack(ends)[good])
    return MeasuredSegments.from_segments(segments, sigmas[good], counts[good].astype(float), moments), walls[good]
