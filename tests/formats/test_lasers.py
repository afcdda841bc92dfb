"""Fields of LaserScan messages that contradict each other or were never set; stamps of 0."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from formats import Log, MalformedFileError, read_log
from vectorization import LaserScan

from .bags import BEGUN, SECOND, USUAL, Laser, Recording, scan_bytes
from .reading import counts, notes

FLT_MAX = float(np.finfo(np.float32).max)
LEAST = 0.0, math.nan, -1.0, math.inf, -math.inf
MIXED = (2.0,) * 89 + (math.inf, 0.0)  # two beams without a return, as one driver and another write them


def read(tmp_path: Path, *lasers: Laser) -> tuple[list[LaserScan], Log]:
    recording = Recording(tmp_path / "a.mcap")
    for k, laser in enumerate(lasers):
        recording.put("/scan", BEGUN + k, scan_bytes(BEGUN + k * SECOND, laser))
    log = read_log(recording.done())
    return [scan.laser for scan in log], log


def assumed(log: Log) -> dict[str, int]:
    """Return the counts of what was assumed of the scans; these recordings have no odometry."""
    return {code: count for code, count in counts(log, "assumed").items() if code != "no_odometry"}


@pytest.mark.parametrize("most", [0.0, -1.0, math.nan, math.inf, FLT_MAX, 1e6, 0.05])
def test_a_greatest_range_that_says_nothing_leaves_readings_and_no_free_space(tmp_path: Path, most: float) -> None:
    lasers, log = read(tmp_path, *[USUAL.but(ranges=MIXED, range_max=most)] * 3)
    for laser in lasers:
        np.testing.assert_array_equal(laser.cleaned, (2.0,) * 89 + (math.nan,) * 2)
    assert assumed(log) == {"range_max": 3}
    assert f"range_max is {np.float32(most):g} m" in notes(log)["range_max"].message


@pytest.mark.parametrize("fields", [{}, {"range_max": 1000.0}, *({"range_min": least} for least in LEAST)])
def test_a_least_range_that_is_none_is_taken_as_0(tmp_path: Path, fields: dict[str, float]) -> None:
    (laser,), log = read(tmp_path, USUAL.but(ranges=MIXED, **fields))
    np.testing.assert_array_equal(laser.cleaned, (2.0,) * 89 + (math.inf, math.nan))
    assert assumed(log) == ({"range_min": 1} if fields.get("range_min") else {})


@pytest.mark.parametrize("fields", [{"range_max": 1.0}, {"range_min": 3.0}])
def test_limits_that_leave_no_range_are_named(tmp_path: Path, fields: dict[str, float]) -> None:
    (_,), log = read(tmp_path, USUAL.but(**fields))
    assert assumed(log) == {"no_range_within": 1}
    assert "range_min" in notes(log)["no_range_within"].message
    assert "range_max" in notes(log)["no_range_within"].message


CLOCKWISE = USUAL.but(angle_min=math.pi / 2, angle_max=-math.pi / 2, angle_increment=-math.pi / 90)
STEP = math.pi / 90


@pytest.mark.parametrize(
    "laser",
    [
        USUAL,
        CLOCKWISE,
        USUAL.but(angle_max=math.pi / 2 + STEP),
        USUAL.but(angle_max=math.pi / 2 - STEP),
        CLOCKWISE.but(angle_max=-math.pi / 2 - STEP),
        USUAL.but(ranges=(2.0,), angle_max=-math.pi / 2),
        Laser((2.0,) * 360, 0.0, math.tau, math.tau / 360),
        Laser((2.0,) * 360, math.pi, -math.pi, -math.tau / 360),
    ],
)
def test_angles_that_agree_within_a_beam_are_taken(tmp_path: Path, laser: Laser) -> None:
    (found,), log = read(tmp_path, laser)
    assert found.angle_increment == pytest.approx(laser.angle_increment)
    assert not assumed(log)


@pytest.mark.parametrize("step", [0.007, 0.03, 0.1])
def test_an_end_of_the_field_of_view_as_angle_max_is_a_note(tmp_path: Path, step: float) -> None:
    """velodyne_laserscan makes as many bins as fit into a turn, and sets angle_max to pi."""
    bins = int(math.tau / step)
    (found,), log = read(tmp_path, Laser((2.0,) * bins, -math.pi, math.pi, step))
    assert found.angles[-1] == pytest.approx(-math.pi + (bins - 1) * step, abs=1e-4)
    off = (math.tau - step * (bins - 1)) / step
    assert f"({off:.3g} beams)" in (notes(log)["angle_max"].message if off > 1.5 else f"({off:.3g} beams)")
    filtered = Laser((2.0,) * 1070, -2.35, -2.35 + 0.004363 * 1080, 0.004363)
    assert "2.7 degrees" in notes(read(tmp_path, filtered)[1])["angle_max"].message


@pytest.mark.parametrize(
    "laser",
    [
        USUAL.but(angle_min=math.pi / 2, angle_max=-math.pi / 2),  # mirrored
        USUAL.but(angle_increment=-STEP),
        Laser((2.0,) * 360, math.pi, -math.pi, math.tau / 360),
        Laser((2.0,) * 360, -math.pi, math.pi, -math.tau / 360),
        USUAL.but(angle_increment=2 * STEP),
        USUAL.but(angle_increment=0.0),
        USUAL.but(angle_max=0.0),
        USUAL.but(angle_max=-math.pi / 2),
        USUAL.but(angle_min=-90.0, angle_max=90.0, angle_increment=2.0),  # degrees
        USUAL.but(angle_max=math.nan),
        USUAL.but(angle_increment=math.nan),
        USUAL.but(angle_min=math.inf),
        USUAL.but(ranges=(2.0,) * 45),
        USUAL.but(ranges=(2.0,) * 93),
    ],
)
def test_angles_that_contradict_each_other_are_refused_by_name(tmp_path: Path, laser: Laser) -> None:
    lasers, log = read(tmp_path, USUAL, laser, laser)
    assert len(lasers) == 1
    note = notes(log)["broken_scan"]
    assert note.count == 2
    assert all(name in note.message for name in ("angle_min", "angle_max", "angle_increment"))
    with pytest.raises(MalformedFileError, match=r"none of its 2 scans can be used; the first of them: .*angle_"):
        read(tmp_path, laser, laser)


def test_a_scan_without_ranges_is_left_out(tmp_path: Path) -> None:
    lasers, log = read(tmp_path, USUAL, USUAL.but(ranges=()))
    assert len(lasers) == 1
    assert counts(log)["broken_scan"] == 1


def stamped(tmp_path: Path, stamps: Sequence[int]) -> tuple[list[int], dict[str, int]]:
    recording = Recording(tmp_path / "a.mcap")
    for k, stamp in enumerate(stamps):
        recording.put("/scan", BEGUN + k * SECOND, scan_bytes(stamp))
    log = read_log(recording.done())
    return [scan.stamp_ns for scan in log], assumed(log)


def test_stamps_that_nobody_set_are_those_of_the_recorder(tmp_path: Path) -> None:
    assert stamped(tmp_path, [0, 0, 0]) == ([BEGUN, BEGUN + SECOND, BEGUN + 2 * SECOND], {"stamp_received": 3})


@pytest.mark.parametrize(
    ("stamps", "told"),
    [
        ((5, 6, 7), {}),
        ((5, 5, 5, 6), {"stamp_repeated": 2}),
        ((5, 4, 3, 9), {"stamp_back": 2}),
        ((5, 5, 4), {"stamp_repeated": 1, "stamp_back": 1}),
    ],
)
def test_stamps_that_repeat_or_jump_back_are_noted(tmp_path: Path, stamps: Sequence[int], told: dict[str, int]) -> None:
    wanted = [second * SECOND for second in stamps]
    assert stamped(tmp_path, wanted) == (wanted, told)


@pytest.mark.parametrize("mark", [b"\xef\xbb\xbf", b""])
def test_a_text_log_may_begin_with_a_byte_order_mark(tmp_path: Path, mark: bytes) -> None:
    path = tmp_path / "a.log"
    path.write_bytes(mark + b"FLASER 3 1.0 2.0 3.0 0 0 0 0 0 0 7.5 host 7.5\n" * 2)
    log = read_log(path)
    assert len(list(log)) == 2
    assert assumed(log)["stamp_repeated"] == 1
    path.write_text("FLASER 1 1.0 0 0 0 0 0 0 7.5 host 7.5\n", encoding="utf-16")
    with pytest.raises(MalformedFileError, match="UTF-16; save it as UTF-8"):
        list(read_log(path))
