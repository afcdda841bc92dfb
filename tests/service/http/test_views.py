"""Scans of several views, and motion within one, over HTTP."""

from __future__ import annotations

import math
from typing import Any

import httpx
import numpy as np
import pytest

from linefix.documents import examples
from registration import RigidTransform

HERE = RigidTransform(1.0, 0.5, math.pi / 2)  # of the robot in the examples' room
MOUNTS = (RigidTransform(0.3, 0.2, math.pi / 4), RigidTransform(-0.3, -0.2, -3.0 * math.pi / 4))
EXACT: dict[str, Any] = {"x": 0.0, "y": 0.0, "theta": 0.0}


def asked(client: httpx.Client, scan: dict[str, Any], status: int = 200, **parts: Any) -> dict[str, Any]:
    response = client.post("/v1/associate", json={**examples.ASSOCIATE, "scan": scan, **parts})
    assert response.status_code == status, response.text
    answer: dict[str, Any] = response.json()
    return answer


def pose_json(at: RigidTransform) -> dict[str, float]:
    return {"x": at.x, "y": at.y, "theta": at.theta}


def seen_from(at: RigidTransform) -> list[list[float]]:
    """Return the walls of the examples' room in the frame of a sensor in the map."""
    walls = np.array(examples.WALLS).reshape(-1, 2, 2)
    ends: list[list[float]] = at.inverse().apply(walls).reshape(-1, 4).tolist()
    return ends


def read_from(at: RigidTransform, angles: np.ndarray) -> list[float]:
    """Return the ranges to the walls of the examples' room."""
    out = []
    for angle in angles + at.theta:
        d = np.array([math.cos(angle), math.sin(angle)])
        best = math.inf
        for x1, y1, x2, y2 in examples.WALLS:
            e, p = np.array([x2 - x1, y2 - y1]), np.array([x1 - at.x, y1 - at.y])
            cross = d[0] * e[1] - d[1] * e[0]
            if abs(cross) > 1e-12:
                reach, share = (p[0] * e[1] - p[1] * e[0]) / cross, (p[0] * d[1] - p[1] * d[0]) / cross
                best = min(best, reach) if reach > 0.0 and 0.0 <= share <= 1.0 else best
        out.append(best)
    return out


def assert_here(answer: dict[str, Any], at: RigidTransform = HERE, distance: float = 0.02) -> None:
    assert (answer["status"], answer["usable"]) == ("ok", True)
    assert answer["pose"]["x"] == pytest.approx(at.x, abs=distance)
    assert answer["pose"]["y"] == pytest.approx(at.y, abs=distance)
    assert answer["pose"]["theta"] == pytest.approx(at.theta, abs=0.01)


def test_a_sensor_with_its_mount_answers_the_pose_of_the_robot(client: httpx.Client) -> None:
    view = {"segments": seen_from(HERE.compose(MOUNTS[0])), "pose": pose_json(MOUNTS[0])}
    answer = asked(client, {"views": [view], "stamp": 7})
    assert_here(answer, distance=1e-6)
    assert (answer["child_frame_id"], answer["stamp"]) == ("base_link", 7)
    assert answer["segments"] == [None]


def test_segments_are_named_by_view_and_index(client: httpx.Client) -> None:
    box = [[0.5, 0.5, 0.7, 0.9]]
    views = [
        {"segments": seen_from(HERE.compose(MOUNTS[0]))[:4], "pose": pose_json(MOUNTS[0])},
        {"segments": box + seen_from(HERE.compose(MOUNTS[1]))[2:], "pose": pose_json(MOUNTS[1])},
    ]
    answer = asked(client, {"views": views})
    assert_here(answer, distance=1e-3)
    assert answer["unmatched_scan"] == [{"view": 1, "scan": 0}]
    named = {(pair["view"], pair["scan"], pair["map"]) for pair in answer["correspondences"]}
    assert named == {(0, k, k) for k in range(4)} | {(1, k, k + 1) for k in range(1, 5)}


@pytest.mark.parametrize("flipped", [False, True])
def test_two_scanners_on_opposite_corners(client: httpx.Client, flipped: bool) -> None:
    """One of them upside down: what it calls left is right."""
    angles = np.linspace(-0.75 * math.pi, 0.75 * math.pi, 541)
    views = []
    for k, mount in enumerate(MOUNTS):
        turned = flipped and k == 1
        ranges = read_from(HERE.compose(mount), -angles if turned else angles)
        laser = {"angle_min": angles[0], "angle_increment": angles[1] - angles[0], "ranges": ranges, "range_max": 30.0}
        views.append({"laser": laser, "pose": pose_json(mount), "flipped": turned})
    answer = asked(client, {"views": views, "frame_id": "base"})
    assert_here(answer)
    assert answer["child_frame_id"] == "base"
    assert len(answer["segments"]) == 2
    walls = HERE.apply(np.array(answer["segments"][1]).reshape(-1, 2, 2))
    assert walls[..., 0].min() > -4.05, "told in the frame that the views share"
    assert {pair["view"] for pair in answer["correspondences"]} == {0, 1}


VIEW = {"segments": examples.SEEN, "pose": EXACT}


def test_a_step_may_be_exact_in_some_directions_or_all(client: httpx.Client) -> None:
    for covariance in ([[0, 0, 0], [0, 0, 0], [0, 0, 0]], [[0.01, 0, 0], [0, 0, 0], [0, 0, 0]]):
        assert_here(asked(client, {"views": [VIEW, {**VIEW, "covariance": covariance}]}))


def test_views_in_a_batch(client: httpx.Client) -> None:
    """A view that is wrong spoils its scan and no other."""
    scans = [{"views": [VIEW]}, {"views": [VIEW, {**VIEW, "relative_to": 5}]}]
    body = {"map": examples.BATCH["map"], "scans": scans}
    good, bad = client.post("/v1/associate:batch", json=body).json()["results"]
    assert good["result"]["correspondences"][0]["view"] == 0
    assert bad["status_code"] == 422
    assert bad["problem"]["errors"][0]["pointer"] == "/scans/1/views/1/relative_to"


def test_a_position_that_is_open_has_no_probability(client: httpx.Client) -> None:
    """Of one wall, and of the two of a corridor; as segments, in a batch too."""
    corridor = {"segments": [[-20.0, 0.0, 20.0, 0.0], [20.0, 2.0, -20.0, 2.0]]}
    both = {"segments": [[-3.0, -1.0, 3.0, -1.0], [3.0, 1.0, -3.0, 1.0]]}
    for scan in (both, {"segments": both["segments"][:1]}):
        answer = asked(client, scan, map=corridor)
        assert (answer["status"], answer["usable"], answer["probability"]) == ("degenerate", False, None)
        assert answer["unobservable"] is not None
    together = client.post("/v1/associate:batch", json={"map": corridor, "scans": [both, {"segments": []}]}).json()
    assert [one["result"]["probability"] for one in together["results"]] == [None, 0.0]
