"""POST /v1/vectorize next to /v1/associate: both cut a scan in the same way."""

from __future__ import annotations

import math
from typing import Any

import httpx
import numpy as np
import pytest

from linefix.documents.requests import VectorizeOptions
from linefix.warmup import ROOM, room_ranges
from vectorization import VectorizationOptions

TURN = np.linspace(-math.pi, math.pi, 240, endpoint=False)


def laser(seed: int) -> dict[str, Any]:
    """Return ranges with so much noise that it shows how fine the cutting is."""
    rng = np.random.default_rng(seed)
    ranges = room_ranges(TURN) + rng.normal(0.0, 0.03, len(TURN))
    return {"angle_min": -math.pi, "angle_increment": TURN[1] - TURN[0], "ranges": ranges.tolist(), "range_max": 30.0}


def contour(clockwise: bool = False) -> list[list[float]]:
    """Return points along a room's walls, as a tracer of pictures gives them."""
    corners = ROOM[:, :2]
    points = [
        (a + (b - a) * share).tolist()
        for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True)
        for share in np.arange(0.0, 1.0, 0.02)
    ]
    return points[::-1] if clockwise else points


def lefts_of(segments: list[list[float]], place: tuple[float, float]) -> list[bool]:
    """Tell of each segment whether a place lies on its left."""
    ends = np.array(segments)
    d, to = ends[:, 2:] - ends[:, :2], np.array(place) - ends[:, :2]
    found: list[bool] = (d[:, 0] * to[:, 1] - d[:, 1] * to[:, 0] > 0.0).tolist()
    return found


def test_both_routes_cut_a_scan_alike(client: httpx.Client) -> None:
    options = VectorizeOptions()
    library = VectorizationOptions()
    for name in ("sigma", "min_points", "min_length", "max_gap"):
        assert getattr(options, name) == getattr(library, name), name
    for seed in range(8):
        scan = {"laser": laser(seed)}
        cut = client.post("/v1/vectorize", json=scan).json()["segments"]
        asked = {"map": {"segments": ROOM.tolist()}, "scan": scan, "options": {"include": ["segments"]}}
        assert client.post("/v1/associate", json=asked).json()["segments"] == cut


def test_points_in_no_order_are_warned_of(client: httpx.Client) -> None:
    points = np.array(contour()) - np.array([2.0, 2.5])
    points = points[np.argsort(np.arctan2(points[:, 1], points[:, 0]))]
    mixed = np.random.default_rng(3).permutation(points)
    for body, codes in (
        ({"points": points.tolist()}, []),
        ({"points": points.tolist(), "viewpoint": None}, []),
        ({"laser": laser(2)}, []),
        ({"points": mixed.tolist()}, ["points_not_in_order"]),
        ({"points": mixed.tolist(), "viewpoint": None}, ["points_not_in_order"]),
    ):
        warnings = client.post("/v1/vectorize", json=body).json()["warnings"]
        assert [one["code"] for one in warnings] == codes


def test_a_contour_runs_as_it_was_drawn_where_it_is_from_no_one_place(client: httpx.Client) -> None:
    """Seen from the origin every wall was turned to face it; of a contour that is no place where a sensor stood."""
    shifted = (np.array(contour()) + np.array([20.0, 0.0])).tolist()  # the origin is outside of the room
    body = {"points": shifted, "viewpoint": None}
    assert all(lefts_of(client.post("/v1/vectorize", json=body).json()["segments"], (20.0, 0.0)))
    back = client.post("/v1/vectorize", json={**body, "points": shifted[::-1]}).json()["segments"]
    assert not any(lefts_of(back, (20.0, 0.0)))


@pytest.mark.parametrize("clockwise", [False, True])
def test_what_was_seen_from_a_place_faces_it(client: httpx.Client, clockwise: bool) -> None:
    shifted = (np.array(contour(clockwise)) + np.array([20.0, 0.0])).tolist()
    body = {"points": shifted, "viewpoint": [20.0, 0.0]}
    found = client.post("/v1/vectorize", json=body).json()["segments"]
    assert len(found) >= len(ROOM)
    assert all(lefts_of(found, (20.0, 0.0)))


def test_null_is_unknown_and_beyond_the_range_is_free(client: httpx.Client) -> None:
    """What is known of a beam without return speaks against a wall there; what is not known says nothing."""
    full = laser(3)
    hidden = [None if 0.3 < angle < 1.2 else r for angle, r in zip(TURN, full["ranges"], strict=True)]
    free = [31.0 if r is None else r for r in hidden]
    short = [0.05 if r is None else r for r in hidden]

    def answer(ranges: list[Any]) -> dict[str, Any]:
        scan = {"laser": {**full, "ranges": ranges, "range_min": 0.1}}
        body = {"map": {"segments": ROOM.tolist()}, "scan": scan, "options": {"include": []}}
        found: dict[str, Any] = client.post("/v1/associate", json=body).json()
        return {name: found[name] for name in ("status", "probability", "diagnostics", "pose")}

    assert answer(hidden) == answer(short)
    assert answer(hidden) != answer(free)


TWIST = {"vx": 0.5, "vy": -0.2, "omega": 1.5}


def test_a_scan_taken_while_moving_is_cut_alike_by_both_routes(client: httpx.Client) -> None:
    moving = {"laser": laser(1) | {"time_increment": 0.1 / len(TURN)}, "twist": TWIST}
    cut = client.post("/v1/vectorize", json=moving).json()["segments"]
    asked = {"map": {"segments": ROOM.tolist()}, "scan": moving, "options": {"include": ["segments"]}}
    assert client.post("/v1/associate", json=asked).json()["segments"] == cut
    assert cut != client.post("/v1/vectorize", json={"laser": moving["laser"]}).json()["segments"]
