"""linefix locate, register, vectorize: as a user runs them, in the process and against a server."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from cli.printing import HINT, verdict_rows
from registration import RigidTransform, Segments
from simulation import Scanner, scan
from tests.batch.logs import ROOM, SEEN
from tests.issuing import ADMIN
from tests.running import RunningService

from .running import Linefix, refused

POINTS = [[0.05 * k, 1.0] for k in range(60)]
PER_REQUEST = ("request_id", "timing_ms")


def lasting(answer: Any) -> dict[str, Any]:
    return {name: value for name, value in answer.items() if name not in PER_REQUEST}


@pytest.fixture(autouse=True)
def _files(folder: Path) -> None:
    (folder / "pairs.json").write_text(json.dumps([[0, 0], [1, 1], [2, 3], [3, 4]]))
    (folder / "points.json").write_text(json.dumps({"points": POINTS, "frame_id": "front"}))


def test_locate_answers_as_the_route_does_without_a_server_and_with_one(
    linefix: Linefix, folder: Path, service: RunningService
) -> None:
    body = {"map": {"segments": ROOM}, "scan": {"segments": SEEN, "sigma": 0.02}}
    expected = lasting(service.client.post("/v1/associate", json=body).json())
    for where in ([], ["--server", service.url]):
        assert lasting(linefix.done("locate", "room.json", "scan.json", "--json", *where).answer) == expected


def test_locate_tells_people_the_verdict(linefix: Linefix, folder: Path) -> None:
    ended = linefix.done("locate", "room.json", "scan.json")
    assert "ok, usable" in ended.out
    assert "x 0.999 m, y 1.001 m" in ended.out
    unlikely = {**linefix.done("locate", "room.json", "scan.json", "--json").answer, "probability": 0.05}
    assert ("hint", HINT.format("")) in verdict_rows(unlikely)
    (folder / "nothing.json").write_text('{"segments": []}')
    assert "no_match" in linefix.done("locate", "room.json", "nothing.json").out  # no answer, and no failure


def test_register_takes_pairs(linefix: Linefix, folder: Path) -> None:
    asked = ("register", "room.json", "scan.json", "--correspondences", "pairs.json")
    answer = linefix.done(*asked, "--json").answer
    assert (answer["status"], answer["diagnostics"]["pairs"]) == ("ok", 4)
    assert re.search(r"^pairs +4$", linefix.done(*asked).out, re.MULTILINE)


def test_what_vectorize_writes_is_a_scan(linefix: Linefix, folder: Path) -> None:
    linefix.done("vectorize", "points.json", "--out", "found.json")
    found = json.loads((folder / "found.json").read_text())
    assert (len(found["segments"]), found["point_counts"], found["frame_id"]) == (1, [60], "front")
    linefix.done("locate", "room.json", "found.json")


def test_vectorize_says_that_points_are_in_no_order(linefix: Linefix, folder: Path) -> None:
    points = [[x / 20, -1.0] for x in range(60)]
    (folder / "mixed.json").write_text(json.dumps({"points": [points[k * 23 % 60] for k in range(60)]}))
    assert "points_not_in_order " in linefix("vectorize", "mixed.json").out
    assert "points_not_in_order" not in linefix("vectorize", "points.json").out


def test_a_key_comes_from_the_environment(linefix: Linefix, folder: Path, guarded: RunningService) -> None:
    asked = ("locate", "room.json", "scan.json", "--server", guarded.url)
    assert "LINEFIX_KEY" in refused(linefix(*asked), 4)
    linefix.done(*asked, LINEFIX_KEY=ADMIN)


def test_a_position_that_is_open_is_told_without_a_probability(linefix: Linefix, folder: Path) -> None:
    (folder / "corridor.json").write_text(json.dumps({"segments": [[-20, 0, 20, 0], [20, 2, -20, 2]]}))
    (folder / "walls.json").write_text(json.dumps({"segments": [[-3, -1, 3, -1], [3, 1, -3, 1]]}))
    ended = linefix("locate", "corridor.json", "walls.json")
    assert "degenerate, not usable" in ended.out
    assert "probability" not in ended.out
    assert linefix.done("locate", "corridor.json", "walls.json", "--json").answer["probability"] is None


def laser_message() -> dict[str, Any]:
    """Return a LaserScan taken in the room, with a beam without return, one too near and an unknown one."""
    scanner = Scanner(beams=360, angle_increment=math.tau / 360)
    pose = RigidTransform(1.0, 1.0, 0.5)
    ranges = scan(Segments.from_array(ROOM), pose, scanner, np.random.default_rng(3)).ranges.tolist()
    ranges[10], ranges[200], ranges[300] = math.inf, -math.inf, math.nan
    step = scanner.angle_increment
    return {"angle_min": scanner.angle_min, "angle_increment": step, "range_max": 30.0, "ranges": ranges}


def test_a_laser_scan_with_infinity_and_nan_is_read(linefix: Linefix, folder: Path) -> None:
    message = laser_message()
    known = [60.0 if r == math.inf else r if math.isfinite(r) else None for r in message["ranges"]]
    (folder / "known.json").write_text(json.dumps({"laser": message | {"ranges": known}}))
    expected = lasting(linefix.done("locate", "room.json", "known.json", "--json").answer)
    assert expected["usable"]
    for form in (message, {"laser": message}):
        (folder / "laser.json").write_text(json.dumps(form))
        assert "Infinity" in (folder / "laser.json").read_text()
        assert lasting(linefix.done("locate", "room.json", "laser.json", "--json").answer) == expected


def echoed(message: dict[str, Any], ranges: Any) -> str:
    """Return a message with other ranges as `ros2 topic echo` prints it."""
    header = {"stamp": {"sec": 12, "nanosec": 5}, "frame_id": "laser"}
    last = message["angle_min"] + 359 * message["angle_increment"]
    more = {"angle_max": last, "time_increment": 0.0, "scan_time": 0.0, "range_min": 0.05, "intensities": []}
    return yaml.safe_dump({"header": header, **message, **more, "ranges": ranges}, sort_keys=False) + "---\n"


def test_scans_as_other_programs_print_them(linefix: Linefix, folder: Path) -> None:
    message = laser_message()
    known = {**message, "ranges": [r if math.isfinite(r) else None for r in message["ranges"]]}
    dotted = echoed(message, message["ranges"])
    bare = dotted.replace(" .inf", " inf").replace("-.inf", "-inf").replace(".nan", "nan")  # of rostopic echo
    lost = "A message was lost!!!\n\ttotal count change:1\n\ttotal count: 1---\n"
    wrapped = json.dumps({"op": "publish", "topic": "/scan", "msg": known})
    for name, content in (
        ("bare.yaml", bare), ("lost.yaml", lost + bare), ("bridge.json", wrapped),
        ("warned.yaml", "WARNING: topic [/scan] does not appear to be published yet\n" + bare),
        ("quoted.json", json.dumps(known | {"ranges": list(map(str, message["ranges"])), "range_max": "30.0"})),
        ("text.json", json.dumps({"op": "publish", "msg": json.dumps(known)})),
        ("mcap.json", json.dumps({"topic": "/scan", "sequence": 0, "log_time": 1.5, "data": known})),
        ("panel.json", json.dumps({"topic": "/scan", "message": known})),
    ):  # fmt: skip
        (folder / name).write_text(content)
        assert linefix.done("locate", "room.json", name, "--json").answer["usable"], name
    (folder / "ros2.yaml").write_text(dotted * 2)
    answer = linefix.done("locate", "room.json", "ros2.yaml", "--json").answer
    assert (answer["usable"], answer["stamp"]) == (True, {"sec": 12, "nanosec": 5})
    assert answer["pose"]["x"] == pytest.approx(1.0, abs=0.05)
    (folder / "noarr.yaml").write_text(echoed(message, "<array type: float32>"))
    assert "without --noarr" in refused(linefix("locate", "room.json", "noarr.yaml"), 3)
    (folder / "foxglove.json").write_text(json.dumps({"start_angle": -3.1, "end_angle": 3.1, "ranges": [1.0, 2.0]}))
    assert "Foxglove, which has no range_max" in refused(linefix("locate", "room.json", "foxglove.json"), 3)
    (folder / "table.csv").write_text("%time,field.header.seq,field.ranges0\n1,2,3.0\n")
    assert "table.csv: is not YAML" in refused(linefix("locate", "room.json", "table.csv"), 3)


def test_ranges_that_ros2_topic_echo_has_cut_are_refused(linefix: Linefix, folder: Path) -> None:
    (folder / "scan.yaml").write_text(echoed(laser_message(), [*[2.0] * 128, "..."]))
    said = refused(linefix("locate", "room.json", "scan.yaml"), 3)
    assert "after 128 values" in said
    assert "--full-length" in said


def test_help_lists_every_exit_code(linefix: Linefix, folder: Path) -> None:
    told = linefix("--help").out
    for code in range(5):
        assert re.search(rf"\b{code} ", told), code
