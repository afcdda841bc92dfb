"""Examples of the contract, each of which is sent to the service by the tests."""

from __future__ import annotations

from typing import Any

WALLS = [
    [-4.0, -3.0, 4.0, -3.0],
    [4.0, -3.0, 4.0, 1.0],
    [4.0, 1.0, 2.5, 1.0],
    [2.5, 1.0, 2.5, 3.0],
    [2.5, 3.0, -4.0, 3.0],
    [-4.0, 3.0, -4.0, -3.0],
]
# The same room as a sensor sees it that stands at (1, 0.5) and looks along the map's y axis.
SEEN = [[y1 - 0.5, -(x1 - 1.0), y2 - 0.5, -(x2 - 1.0)] for x1, y1, x2, y2 in WALLS]

REGISTER: dict[str, Any] = {
    "map": {"segments": WALLS[:2]},
    "scan": {"segments": SEEN[:2], "sigma": 0.02},
    "correspondences": [[0, 0], [1, 1]],
}
ASSOCIATE: dict[str, Any] = {
    "map": {"segments": WALLS, "frame_id": "map"},
    "scan": {"segments": SEEN, "sigma": 0.02, "frame_id": "laser"},
    "options": {"max_alternatives": 2, "deadline_ms": 1000},
}
ASSOCIATE_STORED: dict[str, Any] = {
    "map": {"map_id": "hq-3"},
    "scan": {"segments": SEEN, "sigma": 0.02},
    "prior": {"x": 1.0, "y": 0.5, "theta": 1.6, "radius": 2.0, "angle": 0.5},
}
ASSOCIATE_SEVERAL: dict[str, Any] = {
    "maps": [{"map_id": "ground", "segments": WALLS}, {"map_id": "first", "segments": WALLS[:4]}],
    "scan": {"segments": SEEN, "sigma": 0.02},
    "map_weights": {"ground": 0.8},
}
BATCH: dict[str, Any] = {
    "map": {"segments": WALLS},
    "scans": [{"segments": SEEN}, {"segments": SEEN[:3]}],
    "priors": [None, {"x": 1.0, "y": 0.5, "theta": 1.6, "radius": 2.0, "angle": 0.5}],
}
CHECK: dict[str, Any] = {
    "scans": [{"segments": SEEN}, {"segments": SEEN[:4]}],
    "poses": [{"x": 1.0, "y": 0.5, "theta": 1.57}, None],
}
ANALYZE: dict[str, Any] = {
    "laser": {"fov": 4.7, "beams": 540, "range_max": 12.0, "sigma": 0.02},
    "spacing": 1.0,
    "drive": 3.0,
    "landmark": [[1.0, 0.0, 1.0, 0.5], [1.0, 0.5, 1.6, 0.5], [1.6, 0.5, 1.6, 0.0], [1.6, 0.0, 1.0, 0.0]],
    "deadline_ms": 5000,
}
ANALYZE_ROOM: dict[str, Any] = {"map": {"segments": WALLS}, "spacing": 1.0}
VECTORIZE: dict[str, Any] = {
    "points": [[2.0, 0.1 * i] for i in range(20)] + [[2.0 - 0.1 * i, 2.0] for i in range(20)],
    "options": {"min_points": 5},
}
MAP: dict[str, Any] = {"segments": WALLS, "sigma": 0.01, "oriented": True, "frame_id": "map", "meta": {"floor": 3}}
