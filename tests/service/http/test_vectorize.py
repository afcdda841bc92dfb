"""POST /v1/vectorize next to /v1/associate: both cut a scan in the same way."""

from __future__ import annotations

import math
from typing import Any

import httpx
import numpy as np
import pytest

from linefix.documents import examples
from linefix.documents.requests import VectorizeOptions
from linefix.warmup import ROOM
from registration import RigidTransform
from simulation import Scanner
from tests.service.asking import answered, scanned
from vectorization import VectorizationOptions

SCANNER = Scanner(beams=240, angle_increment=math.tau / 240, range_max=30.0, sigma=0.03)
MAP = {"segments": examples.WALLS}


def laser(seed: int, **more: Any) -> dict[str, Any]:
    """Return ranges with so much noise that it shows how fine the cutting is."""
    return scanned(RigidTransform(0.0, 0.0, 0.0), SCANNER, rng=seed, **more)


def contour() -> np.ndarray:
    """Return points along the room's walls, as a tracer of pictures gives them."""
    corners = ROOM[:, :2]
    edges = np.roll(corners, -1, axis=0) - corners
    return (corners[:, None] + np.arange(0.0, 1.0, 0.02)[:, None] * edges[:, None]).reshape(-1, 2)


def lefts_of(segments: list[list[float]], place: tuple[float, float]) -> list[bool]:
    """Tell of each segment whether a place lies on its left."""
    ends = np.array(segments)
    d, to = ends[:, 2:] - ends[:, :2], np.array(place) - ends[:, :2]
    return (d[:, 0] * to[:, 1] - d[:, 1] * to[:, 0] > 0.0).tolist()


def test_the_options_are_those_of_the_library() -> None:
    for name in ("sigma", "min_points", "min_length", "max_gap"):
        assert getattr(VectorizeOptions(), name) == getattr(VectorizationOptions(), name), name


def test_both_routes_cut_a_scan_alike(client: httpx.Client) -> None:
    """Also one that was taken while moving."""
    moving = {"laser": laser(1, time_increment=0.1 / 240), "twist": {"vx": 0.5, "vy": -0.2, "omega": 1.5}}
    for scan in (*({"laser": laser(seed)} for seed in range(8)), moving):
        cut = answered(client, "/v1/vectorize", scan)["segments"]
        asked = {"map": MAP, "scan": scan, "options": {"include": ["segments"]}}
        assert answered(client, "/v1/associate", asked)["segments"] == cut
    assert cut != answered(client, "/v1/vectorize", laser=moving["laser"])["segments"]


def test_points_in_no_order_are_warned_of(client: httpx.Client) -> None:
    points = contour() - np.array([2.0, 2.5])
    points = points[np.argsort(np.arctan2(points[:, 1], points[:, 0]))]
    mixed = np.random.default_rng(3).permutation(points)
    for cloud, codes in ((points, []), (mixed, ["points_not_in_order"])):
        for more in ({}, {"viewpoint": None}):
            warnings = answered(client, "/v1/vectorize", points=cloud.tolist(), **more)["warnings"]
            assert [one["code"] for one in warnings] == codes
    assert answered(client, "/v1/vectorize", laser=laser(2))["warnings"] == []


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("viewpoint", [None, [20.0, 0.0]], ids=["of no place", "of a place"])
def test_a_contour_runs_as_it_was_drawn_and_what_was_seen_from_a_place_faces_it(
    client: httpx.Client, viewpoint: list[float] | None, clockwise: bool
) -> None:
    """Seen from the origin every wall was turned to face it; of a contour that is no place where a sensor stood."""
    shifted = contour()[:: -1 if clockwise else 1] + np.array([20.0, 0.0])  # the origin is outside of the room
    found = answered(client, "/v1/vectorize", points=shifted.tolist(), viewpoint=viewpoint)["segments"]
    assert len(found) >= len(ROOM)
    assert set(lefts_of(found, (20.0, 0.0))) == {viewpoint is not None or not clockwise}


def test_null_is_unknown_and_beyond_the_range_is_free(client: httpx.Client) -> None:
    """What is known of a beam without return speaks against a wall there; what is not known says nothing."""
    full = laser(3)
    angles = SCANNER.angle_min + SCANNER.angle_increment * np.arange(240)

    def answer(instead: float | None) -> list[Any]:
        ranges = [instead if 0.3 < angle < 1.2 else r for angle, r in zip(angles, full["ranges"], strict=True)]
        scan = {"laser": {**full, "ranges": ranges, "range_min": 0.1}}
        found = answered(client, "/v1/associate", map=MAP, scan=scan, options={"include": []})
        return [found[name] for name in ("status", "probability", "diagnostics", "pose")]

    hidden, near, free = (answer(instead) for instead in (None, 0.05, 31.0))
    assert hidden == near != free
