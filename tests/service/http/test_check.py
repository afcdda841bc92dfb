"""/v1/maps/{map_id}:check."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest
from linefix_client import laser

from linefix.documents import examples
from tests.map_quality.check.drawn import faces, sampled
from tests.service.asking import answered

URL = "/v1/maps/checked:check"


@pytest.fixture(autouse=True)
def _nothing_stays(client: httpx.Client) -> Iterator[None]:
    yield
    client.delete("/v1/maps/checked")


def put(client: httpx.Client, segments: Any) -> Any:
    return client.put("/v1/maps/checked", json={"segments": np.asarray(segments).tolist()}).raise_for_status().json()


def samples() -> list[dict[str, Any]]:
    """Return samples as a client sends them."""
    beams = [scan.beams for _, scan in sampled() if scan.beams]
    return [
        {"laser": laser(one.ranges, one.angles[0], one.angles[1] - one.angles[0], range_max=one.range_max)}
        for one in beams
    ]


def found_in(client: httpx.Client, segments: Any) -> dict[str, Any]:
    put(client, segments)
    return {one["code"]: one for one in client.get(URL).json()["findings"]}


def test_a_map_that_is_right(client: httpx.Client) -> None:
    revision = put(client, examples.WALLS)["revision"]
    answer = client.get(URL).raise_for_status().json()
    assert (answer["findings"], answer["complete"], answer["samples"]) == ([], True, None)
    assert answer["map"] == {"map_id": "checked", "revision": revision}
    assert answer["size"] == {"segment_count": 6, "walls": 6, "length": 28.0, "diagonal": 10.0}
    assert answer["advice"] == {"sigma": None, "oriented": True}
    assert answer["viewpoints"] > 0
    assert answer["timing_ms"].keys() == {"decode", "search", "total"}


def test_findings_name_segments(client: httpx.Client) -> None:
    found = found_in(client, [*examples.WALLS, [0.0, 0.0, 0.05, 0.0], [-3.0, -3.0, 2.0, -3.0]])
    assert found.keys() == {"short_pieces", "overlaps"}
    assert (found["short_pieces"]["segments"], found["short_pieces"]["count"]) == ([6], 1)
    assert found["overlaps"]["segments"] == [0, 7]
    many = [[x, 0.0, x + 0.05, 0.0] for x in np.arange(0.0, 1500.0, 1.0).tolist()]
    short = found_in(client, [*examples.WALLS, *many])["short_pieces"]
    assert (len(short["segments"]), short["count"]) == (1000, 1500)


def test_poses_in_another_frame(client: httpx.Client) -> None:
    put(client, faces())
    moved = [{"x": truth.x + 3.0, "y": truth.y, "theta": truth.theta} for truth, _ in sampled()]
    codes, unknown = (
        [one["code"] for one in answered(client, URL, scans=samples(), poses=poses)["findings"]]
        for poses in (moved, [None] * 6)
    )
    assert "moved" in codes
    assert unknown == [code for code in codes if code != "moved"]


def test_what_there_is_no_time_for_is_left_out(client: httpx.Client) -> None:
    put(client, faces())
    # Long enough to begin, however slow the machine is, and far too short for all.
    for deadline in (600 * 2**k for k in range(6)):
        call = client.post(URL, json={"scans": samples() * 10, "deadline_ms": deadline})
        if call.status_code != 504:
            break
    answer = call.raise_for_status().json()
    assert answer["complete"] is False
    left_out = [one for one in answer["samples"]["scans"] if one["status"] is None]
    assert left_out
    assert all(one["pose"] is None and not one["usable"] for one in left_out)
