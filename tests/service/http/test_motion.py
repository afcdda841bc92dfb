"""Scans of which something is unknown: the motion of the sensor, or ranges that are null."""

from __future__ import annotations

import math
from typing import Any

import httpx
import numpy as np
import pytest

from linefix.documents import examples
from registration import RigidTransform

from .test_views import EXACT, HERE, pose_json, read_from

ANGLES = np.linspace(-math.pi, math.pi, 720, endpoint=False)
STEP = 0.1 / len(ANGLES)  # s from beam to beam
STILL = {"vx": 0.0, "vy": 0.0, "omega": 0.0}
MAP = {"segments": examples.WALLS, "sigma": 0.002}
MOTION, NULLS = "motion_unknown", "nulls_for_no_return"


def laser(at: RigidTransform = HERE, **more: Any) -> dict[str, Any]:
    """Return what a scanner reads all around, all beams at one time."""
    noise = np.random.default_rng(5).normal(0.0, 0.01, len(ANGLES))
    ranges = (np.array(read_from(at, ANGLES)) + noise).tolist()
    return {"angle_min": ANGLES[0], "angle_increment": ANGLES[1] - ANGLES[0], "ranges": ranges, **more}


def found(client: httpx.Client, scan: dict[str, Any]) -> dict[str, Any]:
    response = client.post("/v1/associate", json={"map": MAP, "scan": scan})
    assert response.status_code == 200, response.text
    answer: dict[str, Any] = response.json()
    return answer


def warned(answer: dict[str, Any], code: str = MOTION) -> list[str]:
    return [one["message"] for one in answer["warnings"] if one["code"] == code]


def deviations(answer: dict[str, Any]) -> list[float]:
    deviations: list[float] = np.sqrt(np.diag(answer["covariance"])).tolist()
    return deviations


UNKNOWN = [{"laser": laser(time_increment=STEP)}, {"views": [{"laser": laser(time_increment=STEP), "pose": EXACT}]}]
KNOWN = [
    {"laser": laser()},
    {"laser": laser(time_increment=0.0)},
    {"laser": laser(time_increment=None)},
    {"laser": laser(time_increment=STEP), "twist": STILL},
    {"laser": laser(time_increment=0.0), "twist": STILL},
    {"views": [{"laser": laser(time_increment=STEP), "pose": EXACT, "twist": STILL}]},
]


@pytest.mark.parametrize("scan", UNKNOWN, ids=["one sensor", "views"])
def test_a_motion_that_is_not_known_is_warned_of_and_allowed_for(client: httpx.Client, scan: dict[str, Any]) -> None:
    answer = found(client, scan)
    assert answer["usable"]
    (message,) = warned(answer)
    assert "time_increment of 0.000139 s a scan of 720 beams takes 0.1 s" in message
    assert "twist" in message
    # Half of 0.1 s at 0.5 m/s and 1 rad/s.
    assert deviations(answer) == pytest.approx([0.025, 0.025, 0.05], rel=0.1)


def test_a_step_of_a_drive_keeps_its_own_covariance(client: httpx.Client) -> None:
    step = RigidTransform(-40.0, 0.0, 0.0)  # too far for a lever
    views = [
        {"laser": laser(time_increment=STEP), "pose": EXACT},
        {"laser": laser(time_increment=STEP), "pose": EXACT, "covariance": np.diag([0.04] * 3).tolist()},
        {"laser": laser(time_increment=STEP), "pose": pose_json(step)},
    ]
    first, second = (found(client, {"views": [view]}) for view in views[:2])
    assert deviations(second)[0] == pytest.approx(math.hypot(0.2, deviations(first)[0]), rel=0.1)
    assert len(warned(found(client, {"views": views[:2]}))) == 1
    assert warned(found(client, {"views": views[2:]}))


def test_only_scans_whose_motion_is_not_known_are_warned_of(client: httpx.Client) -> None:
    scans = [*UNKNOWN, *KNOWN]
    told = client.post("/v1/associate:batch", json={"map": MAP, "scans": scans}).json()["results"]
    results = [one["result"] for one in told]
    assert all(one["usable"] for one in results)
    assert [len(warned(one)) for one in results] == [1] * len(UNKNOWN) + [0] * len(KNOWN)
    assert [max(deviations(one)) < 0.005 for one in results] == [False] * len(UNKNOWN) + [True] * len(KNOWN)
    assert results[0]["covariance"] == found(client, scans[0])["covariance"]


def test_segments_of_a_scan_that_took_time_are_warned_of(client: httpx.Client) -> None:
    moved = client.post("/v1/vectorize", json=UNKNOWN[0]).json()
    assert len(warned(moved)) == 1
    for known in KNOWN[:5]:
        assert client.post("/v1/vectorize", json=known).json()["warnings"] == []
    assert moved["segments"] == client.post("/v1/vectorize", json=KNOWN[0]).json()["segments"]


def test_a_map_is_checked_by_samples_as_they_are(client: httpx.Client) -> None:
    client.put("/v1/maps/moving", json={"segments": examples.WALLS}).raise_for_status()
    timed, still = (
        client.post("/v1/maps/moving:check", json={"scans": [scan]}).json() for scan in (UNKNOWN[0], KNOWN[0])
    )
    client.delete("/v1/maps/moving")
    assert {**timed, "timing_ms": None, "request_id": None} == {**still, "timing_ms": None, "request_id": None}


def with_nulls(every: int, **more: Any) -> dict[str, Any]:
    """Return a scan of which one beam in `every` is null."""
    scan = laser(**more)
    scan["ranges"] = [None if k % every == 0 else r for k, r in enumerate(scan["ranges"])]
    return scan


@pytest.mark.parametrize(
    "scan",
    [{"laser": with_nulls(2, range_max=30.0)}, {"views": [{"laser": with_nulls(2, range_max=30.0), "pose": EXACT}]}],
    ids=["one sensor", "views"],
)
def test_many_nulls_and_no_beam_without_a_return_are_warned_of(client: httpx.Client, scan: dict[str, Any]) -> None:
    """Infinity cannot be written as JSON; a bridge that writes null loses the free space as evidence."""
    (message,) = warned(found(client, scan), NULLS)
    assert message.startswith("360 of 720 ranges are null, and none exceeds range_max.")


def test_few_nulls_are_usual(client: httpx.Client) -> None:
    assert warned(found(client, {"laser": with_nulls(4, range_max=30.0)}), NULLS) == []


def test_a_bridge_that_writes_beams_without_a_return_writes_all_of_them(client: httpx.Client) -> None:
    scan = with_nulls(2, range_max=30.0)
    scan["ranges"][1] = 31.0
    assert warned(found(client, {"laser": scan}), NULLS) == []
