"""Requests that are answered, and scans of the room of the examples and of other walls."""

from __future__ import annotations

import math
from typing import Any

import httpx
import numpy as np
from linefix_client import laser

from linefix.documents import examples
from registration import RigidTransform, Segments
from simulation import Scanner, scan

ROOM = Segments.from_array(np.array(examples.WALLS))
HERE = RigidTransform(1.0, 0.5, math.pi / 2)  # where the examples' scan was taken
SCANNER = Scanner(beams=720, angle_increment=math.tau / 720, range_max=30.0, sigma=0.01)
ORIGIN: dict[str, float] = {"x": 0.0, "y": 0.0, "theta": 0.0}


def answered(client: httpx.Client, path: str, body: Any = None, /, **parts: Any) -> Any:
    """Post a body, with parts in place of its own; return the answer, which is no problem."""
    response = client.post(path, json={**(body or {}), **parts})
    assert response.status_code == 200, response.text
    return response.json()


def pose_json(at: RigidTransform) -> dict[str, float]:
    return {"x": at.x, "y": at.y, "theta": at.theta}


def seen_from(at: RigidTransform) -> list[list[float]]:
    """Return the walls of the room in the frame of a sensor in the map."""
    return at.inverse().apply(ROOM.endpoints.reshape(-1, 2, 2)).reshape(-1, 4).tolist()


def scanned(
    at: RigidTransform = HERE,
    scanner: Scanner = SCANNER,
    walls: Segments = ROOM,
    rng: np.random.Generator | int = 5,
    **more: Any,
) -> dict[str, Any]:
    """Return the `laser` of a request for a scan of walls, with more fields."""
    ranges = scan(walls, at, scanner, np.random.default_rng(rng)).ranges
    return {**laser(ranges, scanner.angle_min, scanner.angle_increment, range_max=scanner.range_max), **more}
