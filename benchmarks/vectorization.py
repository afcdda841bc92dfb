"""The vectorizer's and the virtual scanner's rows: speed, accuracy over the bound, walls found, segments that are none.

``python -m benchmarks.vectorization [--poses 300]``. The floor plans and logs are read from the folder that
``LINEFIX_BENCH_DATA`` names, by default ``../shared/data`` next to the repository; without it drawn worlds stand in for
the plans, and the logs are left out.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np

from registration import RigidTransform, Segments, wrap_angle
from simulation import (
    OfficePlan,
    Scanner,
    SimulatedScan,
    cut_square,
    l_room,
    oblique,
    offices,
    pillars,
    scan,
    with_obstacles,
)
from vectorization import LaserScan, Vectorization, VectorizationOptions, vectorize

DATA = Path(os.environ.get("LINEFIX_BENCH_DATA", Path(__file__).parents[1] / ".." / "shared" / "data"))
LOGS = ("intel", "freiburg-079", "seattle", "fhw", "acapulco", "edmonton", "freiburg-campus")

LEAST_BEAMS = 12
LEAST_LENGTH = 0.3  # m
OFFSET_GATE = 0.05  # m
STRAIGHT = 1e-3  # m
ANGLE_GATE = math.radians(3.0)


def as_laser(seen: SimulatedScan) -> LaserScan:
    s = seen.scanner
    return LaserScan(s.angle_min, s.angle_increment, seen.ranges, s.range_min, s.range_max)


def floorplan_scenes(count: int) -> list[tuple[Segments, RigidTransform]]:
    queries = json.loads((DATA / "queries" / "floorplans.json").read_text())[:count]
    plans = {}
    for family in ("apartments", "public_buildings", "campus_buildings"):
        for plan in json.loads((DATA / "floorplans" / f"{family}.json").read_text()):
            plans[family, plan["id"]] = plan["segments"]
    scenes = []
    for query in queries:
        found = next((key for key in plans if key[1] == query["id"]), None)
        if found is not None:
            scenes.append((Segments.from_array(plans[found]), RigidTransform(*query["pose"])))
    return scenes


def drawn_scenes(count: int) -> list[tuple[Segments, RigidTransform]]:
    rng = np.random.default_rng(0)
    floor = offices(rng, OfficePlan(rooms=20, corridors=6))
    worlds = [cut_square(), oblique(0.02), pillars(0.03), l_room(), floor, with_obstacles(floor, 200, rng)]
    scenes = [(world.segments, pose) for world in worlds for pose in world.poses]
    return scenes[:: max(1, len(scenes) // count)]


def in_sensor_frame(map: Segments, pose: RigidTransform) -> Segments:
    return Segments.from_array(pose.inverse().apply(map.endpoints.reshape(-1, 2)).reshape(-1, 4))


def visible_walls(seen: SimulatedScan, map: Segments) -> list[np.ndarray]:
    """Return runs of consecutive beams on one wall, as beam indices; collinear segments that adjoin are one wall."""
    walls: list[np.ndarray] = []
    start = 0
    hits = seen.hits
    same = np.zeros(len(hits), dtype=bool)
    for i in range(1, len(hits)):
        a, b = hits[i - 1], hits[i]
        same[i] = a >= 0 and b >= 0 and (a == b or collinear(map, a, b, seen, i))
    for i in range(1, len(hits) + 1):
        if i == len(hits) or not same[i]:
            if hits[start] >= 0:
                walls.append(np.arange(start, i))
            start = i
    return walls


def collinear(map: Segments, a: int, b: int, seen: SimulatedScan, i: int) -> bool:
    cross = abs(np.cross(np.append(map.directions[a], 0), np.append(map.directions[b], 0))[2])
    off = abs(map.normals[a] @ (map.midpoints[b] - map.midpoints[a]))
    ends = map.endpoints[[a, b]].reshape(2, 2, 2)
    gap = np.min(np.linalg.norm(ends[0][:, None] - ends[1][None], axis=2))
    return bool(cross < 0.02 and off < 0.02 and gap < 0.05)


def judge(seen: SimulatedScan, map: Segments, found: Vectorization) -> dict[str, list[float]]:
    """Compare one scan's segments with the truth; all in the sensor's frame."""
    local = in_sensor_frame(map, seen.pose)
    segments = found.measured.segments
    tally: dict[str, list[float]] = {"offset": [], "angle": [], "claimed": [], "matched": [], "wall": [], "whole": []}
    angles = seen.angles
    true_points = np.where(np.isfinite(seen.true_ranges), seen.true_ranges, 0.0)[:, None] * np.stack(
        [np.cos(angles), np.sin(angles)], axis=1
    )
    walls = [w for w in visible_walls(seen, map) if len(w) >= LEAST_BEAMS]
    extents = [true_points[w[[0, -1]]] for w in walls]
    big = [k for k, e in enumerate(extents) if np.linalg.norm(e[1] - e[0]) >= LEAST_LENGTH]
    met = np.zeros(len(walls), dtype=bool)
    for s in range(len(segments)):
        centroid = found.measured.centroids[s]
        slack = 3.0 * found.measured.sigma[s] / math.sqrt(found.measured.point_counts[s] * found.measured.spreads[s])
        first, last = found.spans[s]
        held = np.arange(first, last + 1) if first <= last else np.r_[first : len(angles), 0 : last + 1]
        good = [k for k in np.unique(seen.hits[held]) if k >= 0 and on_wall(local, k, segments, s, centroid, slack)]
        tally["matched"].append(float(bool(good)))
        if not good:
            continue
        for k in big:
            shared = np.isin(walls[k], held) & np.isin(seen.hits[walls[k]], good)
            met[k] |= shared.sum() >= 0.5 * len(walls[k])
        wall = int(good[np.argmax([np.sum(seen.hits[held] == k) for k in good])])
        off_line = true_points @ local.normals[wall] - local.offsets[wall]
        own = held[np.isfinite(seen.ranges[held]) & (np.abs(off_line[held]) < STRAIGHT)]
        # If plans bend or step by less than the gates no line is the true one; points of other walls are mistakes.
        beside = np.isin(seen.hits[held], good) & (np.abs(off_line[held]) >= STRAIGHT)
        whole = beside.sum() <= 0.02 * len(held)
        tally["whole"].append(float(whole))
        if not whole:
            continue
        errors = over_bound(local, wall, true_points[own], angles[own], seen.scanner.sigma, segments, s)
        if len(own) >= 3:
            tally["offset"].append(errors[0])
            tally["angle"].append(errors[1])
            tally["claimed"].append(claimed(local, wall, found, s))
    tally["wall"] = [float(met[k]) for k in big]
    return tally


def on_wall(local: Segments, k: int, segments: Segments, s: int, centroid: np.ndarray, slack: float) -> bool:
    turn = wrap_angle(math.atan2(*local.directions[k][::-1]) - math.atan2(*segments.directions[s][::-1]))
    turn = min(abs(turn), math.pi - abs(turn))  # plans are not all drawn with free space on the left
    off = abs(local.normals[k] @ centroid - local.offsets[k])
    return bool(turn < ANGLE_GATE + slack and off < OFFSET_GATE)


def over_bound(
    local: Segments, k: int, points: np.ndarray, angles: np.ndarray, sigma: float, segments: Segments, s: int
) -> tuple[float, float]:
    """Errors of offset (at the points' weighted mean) and angle over the standard deviations that the bound allows."""
    normal, along = local.normals[k], local.directions[k]
    rays = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    weights = 1.0 / (sigma * (rays @ normal)) ** 2
    t = points @ along
    mean = np.sum(weights * t) / np.sum(weights)
    spread = np.sum(weights * (t - mean) ** 2)
    middle = local.offsets[k] * normal + mean * along
    turn = math.remainder(math.atan2(*along[::-1]) - math.atan2(*segments.directions[s][::-1]), math.pi)
    off = segments.normals[s] @ middle - segments.offsets[s]
    return float(off * math.sqrt(np.sum(weights))), float(turn * math.sqrt(spread))


def claimed(local: Segments, k: int, found: Vectorization, s: int) -> float:
    """Chi-square (2 degrees of freedom) of offset and angle by what the segment itself claims."""
    m = found.measured
    weight = m.point_counts[s] / m.sigma[s] ** 2
    off = local.normals[k] @ m.centroids[s] - local.offsets[k]
    d = m.segments.directions[s]
    turn = math.remainder(math.atan2(*local.directions[k][::-1]) - math.atan2(*d[::-1]), math.pi)
    return float(weight * off**2 + weight * m.spreads[s] * turn**2)


def rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values else math.nan


def accuracy(name: str, scenes: list[tuple[Segments, RigidTransform]], scanner: Scanner, sigma: float | None) -> None:
    total: dict[str, list[float]] = {}
    for seed, (map, pose) in enumerate(scenes):
        seen = scan(map, pose, scanner, np.random.default_rng(seed))
        found = vectorize(as_laser(seen), VectorizationOptions(sigma=sigma))
        for key, values in judge(seen, map, found).items():
            total.setdefault(key, []).extend(values)
    clipped = {key: [v for v in total[key] if abs(v) < 5] for key in ("offset", "angle")}
    print(
        f"{name:34s} offset/bound {rms(total['offset']):.3f} ({rms(clipped['offset']):.3f} within 5)  "
        f"angle/bound {rms(total['angle']):.3f} ({rms(clipped['angle']):.3f})  "
        f"claimed chi2 {np.mean(total['claimed']):.2f} of 2 (median {np.median(total['claimed']):.2f} of 1.39)  "
        f"of {np.mean(total['whole']):.2f} on one line  "
        f"walls found {np.mean(total['wall']):.3f} of {len(total['wall'])}  "
        f"no wall {1 - np.mean(total['matched']):.4f} of {len(total['matched'])}"
    )


def best_time(function: Callable[[], object], repeats: int = 15) -> float:
    """Milliseconds of the fastest of some calls, the others being disturbed."""
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return 1e3 * min(times)


def speed(scenes: list[tuple[Segments, RigidTransform]]) -> None:
    scanner = Scanner()
    rng = np.random.default_rng(0)
    vector, caster, sizes = [], [], []
    for map, pose in scenes:
        laser = as_laser(scan(map, pose, scanner, rng))
        vector.append(best_time(partial(vectorize, laser)))
        caster.append(best_time(partial(scan, map, pose, scanner, rng)))
        sizes.append(len(map))
    print(f"vectorize 1,080 beams: median {np.median(vector):.3f} ms, p95 {np.quantile(vector, 0.95):.3f} ms")
    per = np.array(caster)[np.array(sizes) >= 800]
    if len(per):
        print(f"scan 1,080 beams, maps of 800 segments or more: median {np.median(per):.3f} ms, max {per.max():.3f} ms")


def logs() -> None:
    for name in LOGS:
        file = DATA / "lidar" / f"{name}.npz"
        if not file.exists():
            continue
        log = np.load(file)
        a = log["angles"]
        rows = []
        for ranges in log["ranges"][::5]:
            laser = LaserScan(a[0], a[1] - a[0], ranges, 0.1001, float(log["range_max_valid"]) - 1e-3)
            found = vectorize(laser)
            returns = max(1, int(np.isfinite(laser.cleaned).sum()))
            rows.append((found.sigma, len(found.measured), found.measured.point_counts.sum() / returns))
        sigma, segments, share = np.median(np.array(rows), axis=0)
        print(f"{name:16s} sigma {sigma:.4f} m, {segments:.0f} segments a scan, {share:.2f} of the points on segments")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=300)
    count = parser.parse_args().poses
    if (DATA / "queries").is_dir():
        name, scenes = "floor plans", floorplan_scenes(count)
    else:
        print(f"no data in {DATA}")
        name, scenes = "drawn worlds", drawn_scenes(count)
    speed(scenes[:: max(1, len(scenes) // 60)])
    accuracy(f"{name}, 2 cm, sigma given", scenes, Scanner(), 0.02)
    accuracy(f"{name}, 2 cm, sigma estimated", scenes, Scanner(), None)
    accuracy(f"{name}, 1 cm, sigma estimated", scenes, Scanner(sigma=0.01), None)
    logs()


if __name__ == "__main__":
    main()
