"""Scans of which something is unknown: the motion of the sensor, or ranges that are null."""

from __future__ import annotations

import math
from typing import Any

import httpx
import numpy as np
import pytest

from linefix.documents import examples
from tests.service.asking import ORIGIN, answered, scanned

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
    "nulls, and a beam without a return": (
        {"laser": {**BRIDGED["laser"], "ranges": [31.0, *BRIDGED["laser"]["ranges"][1:]]}},
        [],
    ),
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
            assert "twist" in message
            # Half of 0.1 s at 0.5 m/s and 1 rad/s.
            assert deviations(answer) == pytest.approx([0.025, 0.025, 0.05], rel=0.1)
        else:
            assert max(deviations(answer)) < 0.005
        for message in warned(answer, NULLS):
            assert message.startswith("360 of 720 ranges are null, and none exceeds range_max.")
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
