"""Files of a public log, as a user of ``linefix map update`` has them: a grid map, and a log of each visit.

The first half of the log makes the grid, at its refined poses. The second half is cut into visits. The logs have no
poses. In addition, the whole log is written, for ``linefix map import --log``.

``--judge`` compares ``FOLDER/LOG/answer.json``, written by ``linefix map update --json``, with the second half of
the log at its refined poses: which part of each wall has returns, and how many beams pass through.

``python -m benchmarks.upkeep.public_logs intel fhw --visits 2 --out FOLDER [--judge]``
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from formats import read_map

from ..grids import grid_of_log
from ..queries import DATA
from ..table import print_table

NO_RETURN = 81.91  # m, as CARMEN writes it
ON, THROUGH, BIN = 0.12, 0.3, 0.1  # m; a beam ends on a wall, or passes through; pieces of a wall
Floats = NDArray[np.float64]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.upkeep.public_logs", description=__doc__)
    parser.add_argument("logs", nargs="+", metavar="LOG", help="names of logs in the data folder, such as intel")
    parser.add_argument("--visits", type=int, default=2, help="number of visits in the second half")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    parser.add_argument("--judge", action="store_true", help="judge FOLDER/LOG/answer.json, and write nothing")
    args = parser.parse_args()
    for name in args.logs:
        if args.judge:
            judge(name, args.out / name)
            continue
        for path in write(name, args.visits, args.out / name):
            print(path)


def write(name: str, visits: int, folder: Path) -> list[Path]:
    """Write ``map.yaml``, ``visit-1.log`` and so on, and ``whole.log``; return their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    with np.load(DATA / "lidar" / f"{name}.npz") as data:
        good, ranges, reach = np.flatnonzero(data["pose_good"]), data["ranges"], float(data["range_max_valid"])
        stamps = data["timestamps"]
    half = len(ranges) // 2
    paths = [grid_of_log(name, good[good < half], folder / "map.yaml")]
    parts = {f"visit-{k + 1}.log": part for k, part in enumerate(np.array_split(np.arange(half, len(ranges)), visits))}
    for file, part in {**parts, "whole.log": np.arange(len(ranges))}.items():
        paths.append(folder / file)
        paths[-1].write_text("".join(_line(ranges[k], float(stamps[k]), reach) for k in part))
    return paths


def judge(name: str, folder: Path) -> None:
    """Print for each wall of a proposal what the second half of the log shows of it."""
    answer = json.loads((folder / "answer.json").read_text())
    known = read_map(folder / "map.yaml").map.segments.endpoints
    origins, ends = _second_half(name)
    rows = []
    for number, change in enumerate(answer["changes"]):
        walls = [("old", known[k]) for k in change["segments"]] + [("new", one["segment"]) for one in change["new"]]
        for which, wall in walls:
            length, covered, on, through = _shown(np.asarray(wall), origins, ends)
            cells = (f"{length:.2f}", f"{covered:.2f}", str(on), str(through))
            rows.append((f"{number} {change['code']}", which, *cells))
    print_table(f"{name}: walls of the proposal", ("change", "wall", "m", "part with returns", "on", "through"), rows)


def _second_half(name: str) -> tuple[Floats, Floats]:
    """Return the origins and the ends of all beams of the second half that came back, at refined poses, (m, 2)."""
    with np.load(DATA / "lidar" / f"{name}.npz") as data:
        poses, angles, ranges = data["poses_refined"], data["angles"], data["ranges"].astype(np.float64)
        good, reach = data["pose_good"], float(data["range_max_valid"])
    rows = np.flatnonzero(good & (np.arange(len(poses)) >= len(poses) // 2))
    scan, beam = np.nonzero((ranges[rows] > 0.1) & (ranges[rows] < reach))
    at, heading = poses[rows][scan], angles[beam] + poses[rows][scan, 2]
    far = ranges[rows][scan, beam, None] * np.stack([np.cos(heading), np.sin(heading)], axis=1)
    return at[:, :2], at[:, :2] + far


def _shown(wall: Floats, origins: Floats, ends: Floats) -> tuple[float, float, int, int]:
    """Return the length of a wall, its part with returns, and the beams that end on it and that pass through."""
    length = float(np.hypot(*(wall[2:] - wall[:2])))
    along = (wall[2:] - wall[:2]) / length
    normal = np.array([-along[1], along[0]])
    place, behind, before = (ends - wall[:2]) @ along, (ends - wall[:2]) @ normal, (origins - wall[:2]) @ normal
    on = (np.abs(behind) <= ON) & (place >= 0.0) & (place <= length)
    bins = max(2, int(length / BIN))
    covered = len(np.unique((place[on] / length * bins).astype(int).clip(max=bins - 1))) / bins
    crossing = (before > THROUGH) & (behind < -THROUGH)
    at = (origins[crossing] - wall[:2]) @ along
    at += (before / (before - behind))[crossing] * (place[crossing] - at) if crossing.any() else 0.0
    return length, covered, int(on.sum()), int(((at >= 0.0) & (at <= length)).sum())


def _line(ranges: NDArray[np.float32], stamp: float, reach: float) -> str:
    numbers = " ".join(f"{NO_RETURN if one >= reach or one <= 0.1 else one:.3f}" for one in ranges)
    return f"FLASER {len(ranges)} {numbers} 0 0 0 0 0 0 {stamp:.3f} robot {stamp:.3f}\n"


if __name__ == "__main__":
    main()
