"""Scans: what is unknown of them, and how they are cut into segments."""

from __future__ import annotations

import math
from typing import Any

import httpx
import numpy as np
import pytest

from linefix.documents import examples
from linefix.documents.requests import VectorizeOptions
from registration import RigidTransform
from simulation import Scanner
from tests.service.asking import ORIGIN, answered, scanned
from vectorization import VectorizationOptions

LASER = scanned()
STEP = 0.1 / 720  # s from beam to beam
STILL = {"vx": 0.0, "vy": 0.0, "omega": 0.0}
MAP = {"segments": examples.WALLS, "sigma": 0.002}
MOTION, NULLS = "motion_unknown", "nulls_for_no_return"


def laser(every: int = 1000, **more: Any) -> dict[str, Any]:
    """Return a scan of which one beam in `every` is null."""
    return {**LASER, "ranges": [None if k % every == every - 1 else r for k, r in enumerate(LASER["ranges"])], **more}


def warned(answer: dict[str, Any], code: str = MOTION) -> list[str]:
    return [one["message"] for one in answer["warnings"] if one["code"] == code]


def deviations(answer: dict[str, Any]) -> list[float]:
    return np.sqrt(np.diag(answer["covariance"])).tolist()


TIMED = {"laser": laser(time_increment=STEP)}
BRIDGED = {"laser": laser(2)}
BEYOND = laser(2) | {"ranges": [31.0, *BRIDGED["laser"]["ranges"][1:]]}
# A scan, and its warnings.
SCANS: dict[str, tuple[dict[str, Any], list[str]]] = {
    "one sensor": (TIMED, [MOTION]),
    "a view": ({"views": [{**TIMED, "pose": ORIGIN}]}, [MOTION]),
    "of a moment": ({"laser": laser()}, []),
    "no time from beam to beam": ({"laser": laser(time_increment=0.0)}, []),
    "null from beam to beam": ({"laser": laser(time_increment=None)}, []),
    "still": ({**TIMED, "twist": STILL}, []),
    "still, and no time": ({"laser": laser(time_increment=0.0), "twist": STILL}, []),
    "a still view": ({"views": [{**TIMED, "pose": ORIGIN, "twist": STILL}]}, []),
    # Infinity cannot be written as JSON; a bridge that writes null loses the free space as evidence.
    "many nulls": (BRIDGED, [NULLS]),
    "many nulls of a view": ({"views": [{**BRIDGED, "pose": ORIGIN}]}, [NULLS]),
    "few nulls": ({"laser": laser(4)}, []),
    "nulls, and a beam without a return": ({"laser": BEYOND}, []),
}


def test_what_is_not_known_is_warned_of_and_allowed_for(client: httpx.Client) -> None:
    asked = [scan for scan, _ in SCANS.values()]
    told = answered(client, "/v1/associate:batch", map=MAP, scans=asked)["results"]
    for name, item in zip(SCANS, told, strict=True):
        answer, codes = item["result"], SCANS[name][1]
        assert ([one["code"] for one in answer["warnings"]], answer["usable"]) == (codes, True), name
        if MOTION in codes:
            (message,) = warned(answer)
            assert "time_increment of 0.000139 s a scan of 720 beams takes 0.1 s" in message
            assert (
                "allows for 0.5 m/s, and for the rotation that the walls allow. Send the motion: over HTTP" in message
            )
            # Half of 0.1 s at 0.5 m/s; the walls show the rotation.
            assert deviations(answer)[:2] == pytest.approx([0.025, 0.025], rel=0.1)
            assert deviations(answer)[2] < 0.01
        else:
            assert max(deviations(answer)) < 0.005
        for message in warned(answer, NULLS):
            assert message.startswith("360 of 720 ranges are null, and none exceeds range_max.")
    blind = answered(client, "/v1/associate", map=MAP, scan={"views": [{**TIMED, "pose": ORIGIN, "viewpoint": None}]})
    assert deviations(blind)[2] == pytest.approx(0.05, rel=0.1), "of whose beams nothing is known, so of its rotation"
    alone = answered(client, "/v1/associate", map=MAP, scan=TIMED)
    assert alone["covariance"] == told[0]["result"]["covariance"]


def test_a_step_of_a_drive_keeps_its_own_covariance(client: httpx.Client) -> None:
    views = [
        {**TIMED, "pose": ORIGIN},
        {**TIMED, "pose": ORIGIN, "covariance": np.diag([0.04] * 3).tolist()},
        {**TIMED, "pose": {"x": -40.0, "y": 0.0, "theta": 0.0}},  # too far for a lever
    ]
    asked = ([views[0]], [views[1]], views[:2], views[2:])
    first, second, both, far = (answered(client, "/v1/associate", map=MAP, scan={"views": one}) for one in asked)
    assert deviations(second)[0] == pytest.approx(math.hypot(0.2, deviations(first)[0]), rel=0.1)
    assert (len(warned(both)), len(warned(far))) == (1, 1)


def test_segments_of_a_scan_that_took_time_are_warned_of(client: httpx.Client) -> None:
    moved = answered(client, "/v1/vectorize", TIMED)
    assert len(warned(moved)) == 1
    for name in ("of a moment", "no time from beam to beam", "null from beam to beam", "still", "still, and no time"):
        assert answered(client, "/v1/vectorize", SCANS[name][0])["warnings"] == []
    assert moved["segments"] == answered(client, "/v1/vectorize", laser=laser())["segments"]


def test_a_map_is_checked_by_samples_as_they_are(client: httpx.Client) -> None:
    client.put("/v1/maps/moving", json={"segments": examples.WALLS}).raise_for_status()
    found = [answered(client, "/v1/maps/moving:check", scans=[scan]) for scan in (TIMED, {"laser": laser()})]
    client.delete("/v1/maps/moving")
    assert found[0]["samples"] == found[1]["samples"]
    assert found[0]["findings"] == found[1]["findings"]


SCANNER = Scanner(beams=240, angle_increment=math.tau / 240, range_max=30.0, sigma=0.03)
WALLS = {"segments": examples.WALLS}


def noisy(seed: int, **more: Any) -> dict[str, Any]:
    """Return ranges with so much noise that it shows how fine the cutting is."""
    return scanned(RigidTransform(0.0, 0.0, 0.0), SCANNER, rng=seed, **more)


def test_the_options_are_those_of_the_library() -> None:
    for name in ("sigma", "min_points", "min_length", "max_gap"):
        assert getattr(VectorizeOptions(), name) == getattr(VectorizationOptions(), name), name


def test_both_routes_cut_a_scan_alike(client: httpx.Client) -> None:
    """Also one that was taken while moving."""
    moving = {"laser": noisy(1, time_increment=0.1 / 240), "twist": {"vx": 0.5, "vy": -0.2, "omega": 1.5}}
    for scan in (*({"laser": noisy(seed)} for seed in range(8)), moving):
        cut = answered(client, "/v1/vectorize", scan)["segments"]
        asked = {"map": WALLS, "scan": scan, "options": {"include": ["segments"]}}
        assert answered(client, "/v1/associate", asked)["segments"] == cut
    assert cut != answered(client, "/v1/vectorize", laser=moving["laser"])["segments"]


def test_what_was_seen_from_a_place_faces_it_and_other_points_run_as_they_come(client: httpx.Client) -> None:
    """Seen from the origin every wall was turned to face it; of a contour that is no place where a sensor stood."""
    up = [[2.0, 0.05 * k] for k in range(60)]
    for points in (up, up[::-1]):
        for viewpoint, (first, last) in ((None, (points[0], points[-1])), ([0.0, 0.0], (up[0], up[-1]))):
            found = answered(client, "/v1/vectorize", points=points, viewpoint=viewpoint)["segments"]
            assert found == [pytest.approx([*first, *last], abs=1e-6)]


def test_null_is_unknown_and_beyond_the_range_is_free(client: httpx.Client) -> None:
    """A beam known to be without return is evidence against a wall there; an unknown one is none."""
    full = noisy(3)
    angles = SCANNER.angle_min + SCANNER.angle_increment * np.arange(240)

    def answer(instead: float | None) -> list[Any]:
        ranges = [instead if 0.3 < angle < 1.2 else r for angle, r in zip(angles, full["ranges"], strict=True)]
        scan = {"laser": {**full, "ranges": ranges, "range_min": 0.1}}
        found = answered(client, "/v1/associate", map=WALLS, scan=scan, options={"include": []})
        return [found[name] for name in ("status", "probability", "diagnostics", "pose")]

    hidden, near, free = (answer(instead) for instead in (None, 0.05, 31.0))
    assert hidden == near != free
