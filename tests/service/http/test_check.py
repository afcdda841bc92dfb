"""/v1/maps/{map_id}:check."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest

from linefix.documents import examples
from tests.map_quality.check.drawn import faces, sampled

URL = "/v1/maps/checked:check"


@pytest.fixture(autouse=True)
def _nothing_stays(client: httpx.Client) -> Iterator[None]:
    yield
    client.delete("/v1/maps/checked")


def put(client: httpx.Client, segments: Any, **more: Any) -> int:
    document = {"segments": np.asarray(segments).tolist(), **more}
    answer = client.put("/v1/maps/checked", json=document)
    answer.raise_for_status()
    return int(answer.json()["revision"])


def scans(count: int) -> list[dict[str, Any]]:
    """Return samples as a client sends them."""
    found = []
    for _, scan in sampled()[:count]:
        beams = scan.beams
        assert beams is not None
        ranges = [r if math.isfinite(r) else 2.0 * beams.range_max for r in beams.ranges.tolist()]
        increment = float(beams.angles[1] - beams.angles[0])
        laser = {"angle_min": float(beams.angles[0]), "angle_increment": increment, "ranges": ranges}
        found.append({"laser": {**laser, "range_max": beams.range_max}})
    return found


def checked(client: httpx.Client, body: dict[str, Any] | None = None) -> dict[str, Any]:
    answer = client.get(URL) if body is None else client.post(URL, json=body)
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def codes(answer: dict[str, Any]) -> list[str]:
    return [one["code"] for one in answer["findings"]]


def test_a_map_that_is_right(client: httpx.Client) -> None:
    revision = put(client, examples.WALLS)
    answer = checked(client)
    assert (answer["findings"], answer["complete"], answer["samples"]) == ([], True, None)
    assert answer["map"] == {"map_id": "checked", "revision": revision}
    assert answer["size"] == {"segment_count": 6, "walls": 6, "length": 28.0, "diagonal": 10.0}
    assert answer["advice"] == {"sigma": None, "oriented": True}
    assert answer["viewpoints"] > 0
    assert answer["timing_ms"].keys() == {"decode", "search", "total"}
    assert client.head(URL).status_code == 200


def test_findings_name_segments(client: httpx.Client) -> None:
    put(client, [*examples.WALLS, [0.0, 0.0, 0.05, 0.0], [-3.0, -3.0, 2.0, -3.0]])
    found = {one["code"]: one for one in checked(client)["findings"]}
    assert found.keys() == {"short_pieces", "overlaps"}
    assert (found["short_pieces"]["segments"], found["short_pieces"]["count"]) == ([6], 1)
    assert found["overlaps"]["segments"] == [0, 7]
    many = [[x, 0.0, x + 0.05, 0.0] for x in np.arange(0.0, 1500.0, 1.0).tolist()]
    put(client, [*examples.WALLS, *many])
    short = next(one for one in checked(client)["findings"] if one["code"] == "short_pieces")
    assert (len(short["segments"]), short["count"]) == (1000, 1500)


def test_poses_in_another_frame(client: httpx.Client) -> None:
    put(client, faces())
    poses: list[dict[str, float] | None] = [
        {"x": truth.x + 3.0, "y": truth.y, "theta": truth.theta} for truth, _ in sampled()
    ]
    answer = checked(client, {"scans": scans(6), "poses": poses})
    assert "moved" in codes(answer)
    assert codes(checked(client, {"scans": scans(6), "poses": [None] * 6})) == [
        code for code in codes(answer) if code != "moved"
    ]


def test_what_there_is_no_time_for_is_left_out(client: httpx.Client) -> None:
    put(client, faces())
    # Long enough to begin, however slow the machine is, and far too short for all.
    for deadline in (600 * 2**k for k in range(6)):
        call = client.post(URL, json={"scans": scans(6) * 10, "deadline_ms": deadline})
        if call.status_code != 504:
            break
    assert call.status_code == 200, call.text
    answer = call.json()
    assert answer["complete"] is False
    left_out = [one for one in answer["samples"]["scans"] if one["status"] is None]
    assert left_out
    assert all(one["pose"] is None and not one["usable"] for one in left_out)
