"""Unusual scans have warnings, ordinary scans have none."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from association import Beams, MapIndex, Scan
from association.scan.extents import inner_extent
from registration import Segments

from .answers import ROOM_INDEX
from .scenes import ANGLES, INSIDE, ROOM, answer_of, beams_of, index_of, scan_of, seen


def codes(scan: Scan, index: MapIndex = ROOM_INDEX) -> list[str]:
    return [warning.code for warning in answer_of(index, scan).warnings]


def test_an_ordinary_scan_is_told_nothing_of() -> None:
    scan = scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0))
    assert codes(scan) == []
    assert codes(replace(scan, beams=beams_of(ROOM_INDEX, INSIDE))) == []


def beams_with(stuck: int, value: float = 7.5) -> Beams:
    """Return 40 ranges of which so many have one value, and 200 beams without return."""
    ranges = np.full(240, math.inf)
    ranges[:40] = np.linspace(2.0, 6.0, 40)
    ranges[:stuck] = value
    return Beams(ANGLES, ranges, 30.0)


@pytest.mark.parametrize(("stuck", "told"), [(20, True), (19, False), (40, True)])
def test_most_of_the_returns_at_one_value(stuck: int, told: bool) -> None:
    scan = scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0), beams=beams_with(stuck))
    assert ("stuck_ranges" in codes(scan)) == told


def test_the_value_is_named() -> None:
    scan = scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0), beams=beams_with(30, 0.05))
    [warning] = [w for w in answer_of(ROOM_INDEX, scan).warnings if w.code == "stuck_ranges"]
    assert warning.message.startswith("30 of 40 ranges are exactly 0.05 m")


def test_a_few_returns_prove_nothing() -> None:
    beams = beams_with(9)
    beams.ranges[9:] = math.inf
    assert "stuck_ranges" not in codes(scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0), beams=beams))
    beams.ranges[9] = 7.5
    assert "stuck_ranges" in codes(scan_of(seen(ROOM, INSIDE)[0], viewpoint=(0.0, 0.0), beams=beams))


@pytest.mark.parametrize(("factor", "told"), [(1.0, False), (1.08, False), (1.2, True), (3.28, True), (1e3, True)])
def test_a_scan_larger_than_the_map(factor: float, told: bool) -> None:
    """All of a room is seen, corner to corner."""
    scan = scan_of(factor * seen(ROOM, INSIDE)[0])
    assert ("scan_exceeds_map" in codes(scan)) == told


def test_what_is_seen_through_a_window_does_not_make_a_scan_large() -> None:
    beyond = np.vstack([seen(ROOM, INSIDE)[0], [[60.0, 0.0, 60.0, 1.5]]])
    assert "scan_exceeds_map" not in codes(scan_of(beyond))
    street = np.vstack([seen(ROOM, INSIDE)[0], [[60.0, -20.0, 60.0, 20.0]]])
    assert "scan_exceeds_map" in codes(scan_of(street))


def test_an_extent_is_that_of_the_longest_way_across() -> None:
    """Of one segment all but a tenth; it stays what it is when it is turned, but for the directions looked in."""
    for angle in np.linspace(0.0, math.pi, 19):
        ends = [[0.0, 0.0, 8.0 * math.cos(angle), 8.0 * math.sin(angle)]]
        assert inner_extent(Segments.from_array(ends)) == pytest.approx(8.0, rel=0.004)
    square = [[0, 0, 1, 0], [1, 0, 1, 1], [1, 1, 0, 1], [0, 1, 0, 0]]
    assert inner_extent(Segments.from_array(np.array(square, dtype=float))) == pytest.approx(math.sqrt(2.0), rel=0.004)
    assert inner_extent(Segments.from_array(np.zeros((0, 4)))) == 0.0


def test_the_size_of_a_map_is_that_of_its_box() -> None:
    assert index_of(ROOM).diagonal == pytest.approx(math.hypot(9.0, 7.0))
    assert index_of(ROOM).undirected.diagonal == pytest.approx(math.hypot(9.0, 7.0))
