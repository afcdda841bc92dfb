"""Two equal rooms, and the posts of one of them, as points of the map."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from linefix import RigidTransform, Segments, simulation

ROOM = np.array([[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]], float)
ROOMS = np.vstack([ROOM, ROOM + np.array([9.0, 0.0, 9.0, 0.0])])
PLACES = [(3.2, 1.0), (1.5, 3.8), (2.6, 2.6), (3.5, 4.2), (5.2, 0.7), (0.6, 3.0)]
POSTS = np.array(
    [[[x + 0.25 * math.cos(k), y + 0.25 * math.sin(k)] for k in np.arange(32) * math.tau / 32] for x, y in PLACES]
)
SCANNER = simulation.Scanner(beams=720, sigma=0.01)
TRUTH = RigidTransform(1.0, 1.5, 0.3)


def ranges() -> Any:
    faces = np.concatenate([POSTS, np.roll(POSTS, -1, axis=1)], axis=2).reshape(-1, 4)
    world = Segments.from_array(np.vstack([ROOMS, faces]))
    return simulation.scan(world, TRUTH, SCANNER, np.random.default_rng(1)).ranges
