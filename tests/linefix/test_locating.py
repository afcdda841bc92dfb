"""Maps and scans in each form, to one answer."""

from __future__ import annotations

import math
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import linefix
from formats import ImportedMap, ImportReport
from tests.association.scenes import known

ROOM = np.array([[0, 0, 6, 0], [6, 0, 6, 2], [6, 2, 4, 2], [4, 2, 4, 5], [4, 5, 0, 5], [0, 5, 0, 0]], dtype=float)
TRUTH = linefix.RigidTransform(1.0, 1.5, 0.4)
SCANNER = linefix.simulation.Scanner(beams=720, sigma=0.01)
ANGLES = (SCANNER.angle_min, SCANNER.angle_increment)


@cache
def ranges() -> Any:
    walls = linefix.Segments.from_array(ROOM)
    return linefix.simulation.scan(walls, TRUTH, SCANNER, np.random.default_rng(2)).ranges


def laser() -> linefix.LaserScan:
    return linefix.LaserScan(*ANGLES, ranges())


def is_found(answer: linefix.AssociationResult) -> bool:
    pose = known(answer.pose)
    return answer.usable and math.hypot(pose.x - TRUTH.x, pose.y - TRUTH.y) < 0.02


@pytest.mark.parametrize("form", ["array", "list", "segments", "map", "imported", "index"])
def test_a_map_is_taken_in_each_form(form: str) -> None:
    segments = linefix.Segments.from_array(ROOM)
    line_map = linefix.LineMap(segments)
    maps: dict[str, Any] = {
        "array": ROOM,
        "list": ROOM.tolist(),
        "segments": segments,
        "map": line_map,
        "imported": ImportedMap(line_map, ImportReport("json", ("room.json",))),
        "index": linefix.index_map(segments),
    }
    assert is_found(linefix.locate(maps[form], laser()))


@pytest.mark.parametrize("form", ["ranges", "laser", "points", "segments", "rows", "scan"])
def test_a_scan_is_taken_in_each_form(form: str) -> None:
    found = linefix.vectorize(laser()).measured.segments
    scans: dict[str, Any] = {
        "ranges": ranges(),
        "laser": laser(),
        "points": laser().points(),
        "segments": found,
        "rows": found.endpoints.tolist(),
        "scan": linefix.scan_of(laser()),
    }
    assert is_found(linefix.locate(ROOM, scans[form], ANGLES if form == "ranges" else None))


def test_a_scanner_that_moved_saw_from_the_middle_of_its_way() -> None:
    motion = linefix.Motion(0.1 / SCANNER.beams, 1.0, 0.0, 0.0)
    scan = linefix.scan_of(linefix.LaserScan(*ANGLES, ranges(), motion=motion))
    assert scan.viewpoint == pytest.approx((0.05, 0.0), abs=1e-3)


@pytest.mark.parametrize("undirected", ["map", "options"])
def test_directions_count_only_where_map_and_options_agree(undirected: str) -> None:
    """Every other wall runs the wrong way: found where directions mean nothing, and there alone."""
    walls = ROOM.copy()
    walls[::2] = walls[::2][:, [2, 3, 0, 1]]
    segments = linefix.Segments.from_array(walls)
    assert not linefix.locate(segments, laser()).usable
    if undirected == "map":
        answer = linefix.locate(linefix.LineMap(segments, oriented=False), laser())
    else:
        answer = linefix.locate(segments, laser(), options=linefix.AssociationOptions(oriented=False))
    assert is_found(answer)


def test_a_map_keeps_what_is_known_of_its_error(tmp_path: Path) -> None:
    file = tmp_path / "room.json"
    linefix.write_map(linefix.LineMap(linefix.Segments.from_array(ROOM), 0.03), file)
    assert linefix.index_map(linefix.read_map(file)).sigma == 0.03
    assert linefix.index_map(ROOM).sigma is None


@pytest.mark.parametrize(
    ("map", "scan", "named"),
    [
        (ROOM, np.ones(10), "angles"),
        (ROOM, [["a", "b", "c", "d"]], "scan"),
        (ROOM, np.ones((3, 5)), "scan"),
        ([[0, 0, 1]], np.ones((3, 2)), "map"),
        ([], np.ones((3, 2)), "map"),
    ],
)
def test_what_is_no_map_or_scan_is_refused_by_name(map: Any, scan: Any, named: str) -> None:
    with pytest.raises(linefix.InputError, match=named):
        linefix.locate(map, scan)


def test_a_map_document_is_indexed_as_its_file_says() -> None:
    index = linefix.index_map({"segments": ROOM, "sigma": 0.03, "oriented": None, "frame_id": "map", "meta": {}})
    assert (index.sigma, len(index.segments), index.directed) == (0.03, len(ROOM), len(ROOM))
    undirected = linefix.index_map({"segments": ROOM, "oriented": False})
    assert (undirected.sigma, len(undirected.segments), undirected.directed) == (None, 2 * len(ROOM), len(ROOM))


@pytest.mark.parametrize(
    ("document", "argument"),
    [
        ({"segments": ROOM, "sgma": 1}, "map.sgma"),
        ({"segments": ROOM, "sigma": "1"}, "map.sigma"),
        ({"segments": ROOM, "sigma": -1}, "map.sigma"),
        ({"segments": ROOM, "oriented": "no"}, "map.oriented"),
        ({"segments": ROOM, "oriented": 1}, "map.oriented"),
        ({"segments": [[1, 2, 3]]}, "map.segments"),
        ({}, "map.segments"),
    ],
)
def test_a_document_that_is_no_map_is_refused(document: dict[str, object], argument: str) -> None:
    with pytest.raises(linefix.InputError) as refused:
        linefix.index_map(document)
    assert refused.value.argument == argument
