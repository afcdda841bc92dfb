"""The files of `examples.sample`, through the commands that docs/ten-minutes.md names."""

from __future__ import annotations

import json
import math
import subprocess
import sys
from pathlib import Path

import numpy as np

from examples.sample import SEED, way_through
from simulation import OfficePlan, offices

from .running import Linefix

CHECKOUT = Path(__file__).parents[3]


def test_the_drive_is_found_in_its_map(linefix: Linefix, folder: Path) -> None:
    subprocess.run([sys.executable, "-m", "examples.sample", folder], cwd=CHECKOUT, check=True, capture_output=True)
    assert linefix("map", "import", "hq.yaml", "--out", "hq.json").code == 0
    ended = linefix("replay", "drive.mcap", "--map", "hq.json", "--mode", "global", "--json")
    found = [json.loads(line) for line in ended.out.splitlines()]
    way = way_through(offices(np.random.default_rng(SEED), OfficePlan(rooms=4, corridors=1)))
    usable = [(one["pose"], pose) for one, pose in zip(found, way, strict=True) if one["usable"]]
    assert len(usable) >= 0.9 * len(way)
    assert all(math.hypot(pose["x"] - at.x, pose["y"] - at.y) < 0.05 for pose, at in usable)
