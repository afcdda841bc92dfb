"""Growth of times: constant-time sums with the pairs, the search with the map, the scan and the share of clutter.

``python -m benchmarks.growth [--queries 30] [--sizes 200,2000,20000,200000]``
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from association import MapIndex, Scan, associate
from linefix.warmup import warm_up
from registration import Correspondences, JointSums, MeasuredSegments, RigidTransform, Segments
from simulation import OfficePlan

from .collection import FLOOR_PLANS, SIGMA
from .drawn import NEAR, campus_of_offices, cluttered_scan, nearby, take_scan
from .outcomes import OPTIONS, offset, progress
from .pictures import Curve, draw_growth
from .queries import data_found, floor_plans
from .table import Row, at_least, at_most, mean, print_rows, print_table, quantile

PAIRS = (10, 100, 1_000, 10_000, 100_000, 1_000_000)
SIZES = (200, 2_000, 20_000, 200_000)
TIMES = {200: (0.3, 0.8), 2_000: (1.0, 3.0), 20_000: (3.0, 12.0), 200_000: (30.0, 120.0)}  # ms, median and p95
CLUTTERED = (5.0, 25.0)  # of the most clutter
INDEX_SECONDS, INDEX_MEGABYTES = 5.0, 500.0  # of the greatest map
SCAN_SEGMENTS = 25
CLUTTER = 0.3
SCANS = (6, 12, 25, 40)  # segments
CLUTTERS = (0.0, 0.15, 0.3, 0.5, 0.7)
SWEPT = 2_000  # map segments for the growth over scan and clutter
SEED = 20190901
LANE = 400.0  # m; where a row of the campus ends
APART = 5.0  # m between plans
DISTANCE, ANGLE = 0.1, 1.0  # m, degrees


def best_time(action: Callable[[], object], repeats: int) -> float:
    """Return the processor seconds of the fastest of some calls, the others being disturbed."""
    times = []
    for _ in range(repeats):
        start = time.thread_time()
        action()
        times.append(time.thread_time() - start)
    return min(times)


def sums_times(counts: tuple[int, ...]) -> list[tuple[float, float, float]]:
    """Time adding a pair to sums over many, solving, and summing again; microseconds."""
    rng = np.random.default_rng(SEED)
    return [_sums_times(count, rng) for count in counts]


def _sums_times(count: int, rng: np.random.Generator) -> tuple[float, float, float]:
    middles, angles = rng.uniform(-20.0, 20.0, (count + 1, 2)), rng.uniform(-math.pi, math.pi, count + 1)
    half = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    segments = Segments.from_array(np.hstack([middles - half, middles + half]))
    rows = np.repeat(np.arange(count + 1), 2).reshape(-1, 2)
    pairs = Correspondences.of(segments, MeasuredSegments.from_segments(segments, SIGMA), rows)
    everything, weights = pairs.take(slice(0, count)), np.full(count, 1e4)
    sums = JointSums.of_set(everything, weights)
    add = best_time(lambda: sums.add(pairs, count, 1e4), 300)
    solve = best_time(lambda: sums.solve(0.0), 300)
    anew = best_time(lambda: JointSums.of_set(everything, weights), 30 if count < 100_000 else 5)
    return 1e6 * add, 1e6 * solve, 1e6 * anew


def campus(size: int) -> Segments:
    """Lay floor plans, or drawn offices, side by side until there are `size` segments; cut off what is beyond.

    Each plan comes once as it is. When all have been laid they come mirrored and stretched by up to a tenth, so that no
    place has an exact copy.
    """
    if not data_found():
        plan = OfficePlan(rooms=8, corridors=3)
        world = campus_of_offices(np.random.default_rng(SEED), 1 + size // 250, plan)
        return world.segments.take(np.arange(min(size, len(world.segments))))
    return Segments.from_array(np.vstack(campus_plans(size)))


def campus_plans(size: int) -> list[np.ndarray]:
    """Return the floor plans of a campus, each (n, 4); they need the data folder."""
    rng = np.random.default_rng(SEED)
    plans = [s.endpoints for key, s in sorted(floor_plans().maps.items()) if key[0] in FLOOR_PLANS]
    if size < 1000:
        plans = [p for p in plans if len(p) <= size]
    pieces: list[np.ndarray] = []
    x = y = deepest = 0.0
    left, lap = size, 0
    while left > 0:
        for k in rng.permutation(len(plans)):
            ends = plans[k]
            if lap:
                ends = ends * rng.uniform(0.9, 1.1) * [-1.0, 1.0, -1.0, 1.0]
                ends = ends[:, [2, 3, 0, 1]]  # a mirror exchanges left and right
            corners = ends.reshape(-1, 2)
            low, extent = corners.min(axis=0), np.ptp(corners, axis=0)
            if x > 0.0 and x + extent[0] > LANE * math.sqrt(size / 20_000):
                x, y, deepest = 0.0, y + deepest + APART, 0.0
            pieces.append((ends + np.tile([x, y] - low, 2))[:left])
            x, deepest, left = x + extent[0] + APART, max(deepest, float(extent[1])), left - len(pieces[-1])
            if left == 0:
                break
        lap += 1
    return pieces


def draw_query(
    segments: Segments, rng: np.random.Generator, count: int = SCAN_SEGMENTS, share: float = CLUTTER
) -> tuple[RigidTransform, Segments]:
    """Scan the campus from a free place where enough is seen; keep some `count` segments, `share` of them clutter."""
    mapped_count, slack = round(count * (1.0 - share)), round(0.2 * count)
    while True:
        pose = _free_pose(segments, rng)
        scan, mapped = cluttered_scan(segments, pose, share, rng)
        on_map, clutter = np.flatnonzero(mapped), np.flatnonzero(~mapped)
        if len(on_map) >= mapped_count - slack and len(clutter) >= min(slack, round(count * share)):
            on_map = on_map[:mapped_count]
            clutter = clutter[: round(len(on_map) * share / (1.0 - share))]
            return pose, scan.take(rng.permutation(np.concatenate([on_map, clutter])))


def _free_pose(segments: Segments, rng: np.random.Generator) -> RigidTransform:
    """Draw a place from which most that is seen shows its free side and is not too near."""
    while True:
        k = rng.integers(len(segments))
        p = segments.midpoints[k] + rng.uniform(1.0, 4.0) * segments.normals[k]
        pose = RigidTransform(p[0], p[1], rng.uniform(-math.pi, math.pi))
        near = nearby(segments, pose, NEAR)
        measured, walls = take_scan(near, pose, rng)
        found = np.flatnonzero(walls >= 0)
        if len(found) < 8:
            continue
        seen = near.take(walls[found])
        facing = np.einsum("ij,ij->i", p - seen.midpoints, seen.normals) > 0.0
        if np.mean(facing) > 0.95 and np.min(np.linalg.norm(measured.segments.midpoints, axis=1)) > 0.5:
            return pose


@dataclass(frozen=True, slots=True)
class Growth:
    """Searches in a map of one size: processor times in ms, shares, and what the index takes."""

    segments: int
    median: float
    p95: float
    passed: float
    hypotheses: float
    right: float
    wrong_usable: int
    scan: float
    build: float
    megabytes: float


def grow(size: int, queries: int, count: int = SCAN_SEGMENTS, share: float = CLUTTER) -> Growth:
    """Index a campus and search it for scans of so many segments, a share of them clutter."""
    rng = np.random.default_rng(SEED)
    segments = campus(size)
    start = time.thread_time()
    index = MapIndex.build(segments)
    build = time.thread_time() - start
    cpu, passed, hypotheses, right, wrong, counts = [], [], [], [], 0, []
    for k in range(queries + 2):
        pose, scan = draw_query(segments, rng, count, share)
        sent = Scan(MeasuredSegments.from_segments(scan, SIGMA))
        began = time.perf_counter(), time.thread_time()
        result = associate(index, sent, None, OPTIONS)
        times = time.perf_counter() - began[0], time.thread_time() - began[1]
        if k < 2:
            continue  # warm-up
        off = (math.inf, math.inf) if result.pose is None else offset(result.pose, pose)
        right.append(off[0] < DISTANCE and off[1] < ANGLE)
        wrong += result.usable and not right[-1]
        passed.append(1e3 * times[0])
        cpu.append(1e3 * times[1])
        hypotheses.append(result.search.hypotheses)
        counts.append(len(scan))
        progress(f"{size:,} segments, {count} of {share:.0%} clutter", k - 1, queries)
    return Growth(
        len(segments), quantile(cpu, 0.5), quantile(cpu, 0.95), quantile(passed, 0.5), quantile(hypotheses, 0.5),
        mean(right), wrong, mean(counts), build, index.nbytes / 1e6,
    )  # fmt: skip


def print_growth(title: str, what: str, values: Sequence[str], found: list[Growth]) -> None:
    cells = [
        (value, f"{g.median:.2f}", f"{g.p95:.2f}", f"{g.passed:.2f}", f"{g.hypotheses:,.0f}",
         f"{g.right:.2f}", str(g.wrong_usable), f"{g.scan:.0f}", f"{g.build:.2f}", f"{g.megabytes:.1f}")
        for value, g in zip(values, found, strict=True)
    ]  # fmt: skip
    head = (what, "median ms", "p95 ms", "median ms passed", "hypotheses", "right first", "usable, wrong",
            "scan segments", "index s", "index MB")  # fmt: skip
    print_table(title, head, cells)


def growth_rows(found: list[Growth]) -> list[Row]:
    """Judge the times of the sizes that goals were set for; return what was measured of the others, too."""
    rows = []
    for g in found:
        median, p95 = TIMES.get(g.segments, (None, None))
        rows.append(at_most(f"{g.segments:,} map segments: search, median ms", g.median, None, median, ".2f"))
        rows.append(at_most(f"{g.segments:,} map segments: search, p95 ms", g.p95, None, p95, ".2f"))
    for g in found:
        seconds, megabytes = (INDEX_SECONDS, INDEX_MEGABYTES) if g.segments == SIZES[-1] else (None, None)
        rows.append(at_most(f"{g.segments:,} map segments: index, s", g.build, None, seconds, ".2f"))
        rows.append(at_most(f"{g.segments:,} map segments: index, MB", g.megabytes, None, megabytes, ".1f"))
        rows.append(at_least(f"{g.segments:,} map segments: right first", g.right, form=".2f"))
    return rows


def growth(queries: int, sizes: tuple[int, ...], pairs: tuple[int, ...] = PAIRS) -> list[Row]:
    """Run all, print their tables, draw the picture and return the rows that were judged."""
    times = sums_times(pairs)
    head = ("pairs in the sums", "add one, us", "solve, us", "sum again, us")
    cells = [(f"{k:,}", *(f"{t:,.1f}" for t in row)) for k, row in zip(pairs, times, strict=True)]
    print_table("Constant-time sums of the joint estimator", head, cells)
    warm_up()  # as a service does: what a first scan of its kind needs is compiled, and loaded
    grow(sizes[0], 10)
    found = [grow(size, queries) for size in sizes]
    print_growth("Search over the size of the map", "map segments", [f"{g.segments:,}" for g in found], found)
    scans = [grow(SWEPT, queries, count=count) for count in SCANS]
    print_growth(f"Search over the size of the scan, {SWEPT:,} map segments", "wanted", list(map(str, SCANS)), scans)
    clutters = [grow(SWEPT, queries, share=share) for share in CLUTTERS]
    print_growth(
        f"Search over the clutter, {SWEPT:,} map segments", "clutter", [f"{c:.0%}" for c in CLUTTERS], clutters
    )
    draw_growth(
        [
            Curve("map segments", [g.segments for g in found], [(g.median, g.p95) for g in found],
                  {size: goal for size, goal in TIMES.items() if size in sizes}),
            Curve("scan segments", [g.scan for g in scans], [(g.median, g.p95) for g in scans]),
            Curve("share of clutter", CLUTTERS, [(g.median, g.p95) for g in clutters]),
        ],
        [(g.segments, g.build, g.megabytes) for g in found],
        list(zip(pairs, times, strict=True)),
    )  # fmt: skip
    rows = growth_rows(found)
    most, (median, p95) = clutters[-1], CLUTTERED
    what = f"{SWEPT:,} map segments, {CLUTTERS[-1]:.0%} of clutter: search"
    rows.append(at_most(f"{what}, median ms", most.median, None, median, ".2f"))
    rows.append(at_most(f"{what}, p95 ms", most.p95, None, p95, ".2f"))
    print_rows("Growth", rows)
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--queries", type=int, default=30, help="a size")
    parser.add_argument("--sizes", default=",".join(map(str, SIZES)))
    args = parser.parse_args()
    growth(args.queries, tuple(int(size) for size in args.sizes.split(",")))


if __name__ == "__main__":
    main()
