"""Files of a public log, as a user of ``linefix map update`` has them: a grid map, and a log of each visit.

The first half of the log makes the grid, at its refined poses. The second half is cut into visits. The logs have no
poses. In addition, the whole log is written, for ``linefix map import --log``.

``python -m benchmarks.upkeep.public_logs intel fhw --visits 2 --out FOLDER``
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..grids import grid_of_log
from ..queries import DATA

NO_RETURN = 81.91  # m, as CARMEN writes it


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.upkeep.public_logs", description=__doc__)
    parser.add_argument("logs", nargs="+", metavar="LOG", help="names of logs in the data folder, such as intel")
    parser.add_argument("--visits", type=int, default=2, help="number of visits in the second half")
    parser.add_argument("--out", type=Path, required=True, metavar="FOLDER")
    args = parser.parse_args()
    for name in args.logs:
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


def _line(ranges: NDArray[np.float32], stamp: float, reach: float) -> str:
    numbers = " ".join(f"{NO_RETURN if one >= reach or one <= 0.1 else one:.3f}" for one in ranges)
    return f"FLASER {len(ranges)} {numbers} 0 0 0 0 0 0 {stamp:.3f} robot {stamp:.3f}\n"


if __name__ == "__main__":
    main()
