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
# Ranges of a scanner with 90 beams in the room, at (1, 0.5) and turned by 0.3 rad.
RANGES = [
    5.24, 5.37, 5.53, 5.72, 5.98, 5.79, 5.31, 4.94, 4.63, 4.37, 4.16, 4.0, 3.85, 3.74, 3.65, 3.59, 3.54, 3.51,
    3.5, 3.5, 3.53, 3.57, 3.63, 3.71, 3.79, 3.93, 4.09, 4.28, 4.52, 4.38, 4.1, 3.84, 3.65, 3.5, 3.36, 3.26,
    3.17, 3.09, 3.06, 3.02, 3.0, 3.0, 3.01, 3.03, 2.19, 1.69, 1.61, 1.66, 1.72, 1.8, 1.88, 1.99, 2.13, 2.29,
    2.51, 2.76, 2.86, 2.75, 2.67, 2.61, 2.56, 2.53, 2.5, 2.49, 2.5, 2.52, 2.55, 2.59, 2.64, 2.72, 2.82, 2.92,
    3.05, 3.23, 3.43, 3.68, 3.99, 4.37, 4.88, 5.54, 5.43, 5.28, 5.16, 5.08, 5.04, 5.01, 5.0, 5.02, 5.07, 5.14,
]  # fmt: skip
_LASER = {"angle_min": -3.14159, "angle_increment": 0.0698132, "range_max": 20.0, "ranges": RANGES}
UPDATE: dict[str, Any] = {
    "visits": [
        {
            "visit": "monday",
            "scans": [
                {
                    "laser": _LASER,
                    "pose": {"x": 1.0, "y": 0.5, "theta": 0.3},
                    "covariance": [[0.04, 0.0, 0.0], [0.0, 0.04, 0.0], [0.0, 0.0, 0.01]],
                }
            ],
        },
        {"visit": "tuesday", "scans": [{"laser": _LASER}]},
    ],
    "accept": 0.99,
}
_BOX = [[2.0, 2.0, 2.0, 3.0], [2.0, 3.0, 3.0, 3.0], [3.0, 3.0, 3.0, 2.0], [3.0, 2.0, 2.0, 2.0]]
APPLY: dict[str, Any] = {
    "map": {"segments": WALLS + _BOX, "sigma": 0.01},
    "changes": [
        {"code": "removed", "segments": [len(WALLS) + k for k in range(4)], "new": [], "accepted": True},
        {"code": "added", "segments": [], "new": [{"segment": [1.0, 1.0, 1.5, 1.0], "sigma": 0.01}], "accepted": False},
    ],
}
VECTORIZE: dict[str, Any] = {
    "points": [[2.0, 0.1 * i] for i in range(20)] + [[2.0 - 0.1 * i, 2.0] for i in range(20)],
    "options": {"min_points": 5},
}
MAP: dict[str, Any] = {"segments": WALLS, "sigma": 0.01, "oriented": True, "frame_id": "map", "meta": {"floor": 3}}
