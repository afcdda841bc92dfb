"""The check of a map finds its doubtful parts, alone and with sample scans, and nothing in maps without them."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from association import AssociationOptions, CancelledError, Deadline, MapIndex, Scan, associate, scaled
from linefix import LaserScan, scan_of
from map_quality import MapCheck, Sample, SampleReport, check_map, conclude, try_sample
from registration import MeasuredSegments, RigidTransform, Segments
from registration.layout import Floats
from simulation import OfficePlan, offices

from ...association.scenes import maze
from .drawn import THICK, centre_lines, faces, index_of, reversed_ends, sampled, two_faces

# A room with a niche, a wall with two faces in it, free space on the left.
ROOM = np.array(
    [
        [0, 0, 8, 0], [8, 0, 8, 4], [8, 4, 6, 4], [6, 4, 6, 6], [6, 6, 0, 6], [0, 6, 0, 0],
        [2, 2, 2, 4], [2, 4, 2.2, 4], [2.2, 4, 2.2, 2], [2.2, 2, 2, 2],
    ],
    dtype=float,
)  # fmt: skip


def checked(segments: Floats, *, oriented: bool = True) -> MapCheck:
    return check_map(index_of(segments), oriented=oriented)


def found(segments: Floats, *, oriented: bool = True) -> dict[str, tuple[int, ...]]:
    """Return the findings by their codes."""
    return {one.code: one.segments for one in checked(segments, oriented=oriented).findings}


def test_a_map_that_is_right() -> None:
    result = checked(ROOM)
    assert result.findings == ()
    assert (result.advice.sigma, result.advice.oriented) == (None, True)
    assert (result.size.segment_count, result.size.walls) == (10, 10)
    assert (result.size.length, result.size.diagonal) == pytest.approx((28.0 + 4.4, 10.0))
    assert (result.complete, result.places) == (True, ())
    assert result.viewpoints >= 4


def test_every_finding_is_a_sentence() -> None:
    for walls in (ROOM * 1e-2, reversed_ends(ROOM), centre_lines(), np.vstack([ROOM, ROOM + 0.04])):
        for one in checked(walls).findings:
            assert one.message[0].isupper() or one.message[0].isdigit()
            assert one.message.endswith((".", "?"))
            assert all(isinstance(index, int) for index in one.segments)


def test_all_the_wrong_way_round() -> None:
    for walls in (reversed_ends(ROOM), reversed_ends(faces())):
        assert "reversed" in found(walls)
        assert "reversed" not in found(walls, oriented=False)


def test_a_hall_too_wide_to_look_across() -> None:
    """Each wall has both faces; what a ray has not met by the time that it is left may well be there."""
    inside = 300.0 * np.array([[0, 0, 1, 0], [1, 0, 1, 1], [1, 1, 0, 1], [0, 1, 0, 0]])
    outside = reversed_ends(1.004 * (inside - 150.0) + 150.0)
    for walls in (np.vstack([inside, outside]), 100.0 * faces()):
        assert "reversed" not in found(walls)
    assert "reversed" in found(reversed_ends(0.1 * inside))


def test_one_the_wrong_way_round() -> None:
    walls = offices(np.random.default_rng(0)).map.endpoints.copy()
    middles = 0.5 * (walls[:, :2] + walls[:, 2:])
    inner = (np.abs(middles - middles.mean(axis=0)) < 0.3 * np.ptp(middles, axis=0)).all(axis=1)
    long = int(np.argmax(np.hypot(*(walls[:, 2:] - walls[:, :2]).T) * inner))
    walls[long] = walls[long, [2, 3, 0, 1]]
    assert found(walls)["mixed_directions"] == (long,)
    assert checked(walls).advice.oriented is None


@pytest.mark.parametrize("quarters", range(4))
def test_one_the_wrong_way_round_next_to_walls_longer_than_rays_are_followed(quarters: int) -> None:
    """The opposite face of the pillar is doubtful, too: between both there is free space or none."""
    corners = np.array([[0, 0], [100, 0], [100, 20], [0, 20], [4, 4], [6, 4], [6, 12], [4, 12]], dtype=float)
    for _ in range(quarters):
        corners = corners[:, ::-1] * [-1.0, 1.0]
    walls = np.hstack([corners, corners[[1, 2, 3, 0, 7, 4, 5, 6]]])
    walls[4] = walls[4, [2, 3, 0, 1]]
    assert found(walls)["mixed_directions"] == (4, 6)


@pytest.mark.xfail(strict=True, reason="looks_alike is found as well")
def test_lines_without_direction() -> None:
    result = checked(centre_lines())
    assert [one.code for one in result.findings] == ["mixed_directions"]
    assert result.advice.oriented is False
    assert '"oriented": false' in result.findings[0].message
    assert found(centre_lines(), oriented=False) == {}


@pytest.mark.parametrize("seed", range(4))
def test_directions_thrown_away_and_kept(seed: int) -> None:
    walls = offices(np.random.default_rng(seed), OfficePlan(rooms=4, corridors=1)).map.endpoints
    assert checked(walls).advice.oriented is True
    turned = np.random.default_rng(seed).random(len(walls)) < 0.5
    result = checked(np.where(turned[:, None], reversed_ends(walls), walls))
    assert "mixed_directions" in [one.code for one in result.findings]
    assert result.advice.oriented is not True


CRUMBS = [[4.0, 3.0, 4.05, 3.0], [4.5, 3.0, 4.5, 3.08]]
WHOLE = [[4.0 + 0.05 * k, 3.0, 4.05 + 0.05 * k, 3.0] for k in range(20)]


@pytest.mark.parametrize(
    ("walls", "expected"),
    [
        ([*ROOM, *CRUMBS], {"short_pieces": (10, 11)}),
        ([*ROOM, *WHOLE], {}),
        ([*ROOM, [1.0, 0.0, 3.0, 0.0], [8.0, 1.01, 8.0, 2.0]], {"overlaps": (0, 1, 10, 11)}),
        ([*ROOM, [1.0, 0.01, 3.0, 0.01]], {"overlaps": (0, 10)}),
        ([*ROOM[1:], [0.0, 0.0, 4.0, 0.0], [3.99, 0.0, 8.0, 0.0]], {}),
        ([*ROOM, [0.5, 0.1, 7.0, 0.1]], {"doubled_faces": (0, 10)}),  # looks the same way as the wall behind it
        ([*ROOM, [7.0, 0.15, 0.5, 0.15]], {"doubled_faces": (0, 10)}),  # looks at it
        ([*ROOM, [4.0, 1.0, 4.0, 3.0], [4.0, 3.0, 4.0, 1.0]], {"both_ways": (10, 11)}),  # without thickness
    ],
)
def test_how_lines_are_drawn(walls: list[Floats], expected: dict[str, tuple[int, ...]]) -> None:
    kinds = ("short_pieces", "overlaps", "doubled_faces", "both_ways")
    result = checked(np.array(walls))
    assert {one.code: one.segments for one in result.findings if one.code in kinds} == expected
    assert result.advice.oriented is True


def test_gaps() -> None:
    walls = ROOM.copy()
    walls[0, 2] = 7.92  # ends before the corner
    walls[3, 3] = 5.0
    walls = np.vstack([walls, [[6, 5.08, 6, 6]]])  # goes on behind a slit
    assert found(walls)["gaps"] == (0, 1, 3, 10)
    walls[0, 2] = 7.0  # a door
    assert found(walls)["gaps"] == (3, 10)


@pytest.mark.parametrize(("sigma", "gaps"), [(None, (0,)), (0.005, (0,)), (0.01, (0,)), (0.025, ())])
def test_gaps_within_the_declared_error_of_a_map_are_none(sigma: float | None, gaps: tuple[int, ...]) -> None:
    """As in the map of a grid: its walls end where their own cells do, and they declare half a cell."""
    walls = ROOM.copy()
    walls[0, 2] = 7.92  # ends before the corner
    index = MapIndex.build(Segments.from_array(walls), sigma)
    assert {one.code: one.segments for one in check_map(index).findings}.get("gaps", ())[:1] == gaps


@pytest.mark.parametrize(("factor", "told"), [(1.0, False), (0.1, True), (100.0, True), (1000.0, True)])
def test_a_size_that_no_building_has(factor: float, told: bool) -> None:
    assert ("unlikely_size" in found(ROOM * factor)) is told


@pytest.mark.parametrize("step", [0.05, 0.02, 0.1])
def test_a_raster_says_how_far_lines_are_off(step: float) -> None:
    off = np.array([1.234, -7.77, 1.234, -7.77])
    drawn = offices(np.random.default_rng(1)).map.endpoints
    walls = np.round(drawn / step) * step
    walls = walls[np.hypot(*(walls[:, 2:] - walls[:, :2]).T) > 0.0]
    assert checked(walls + off).advice.sigma == round(step / math.sqrt(12.0), 4)
    assert checked(drawn).advice.sigma is None
    assert checked(walls[:20]).advice.sigma is None


def test_what_looks_alike() -> None:
    """Three equal rooms in a row, and one of its own."""
    room = np.array([[0, 0, 4, 0], [4, 0, 4, 3], [4, 3, 1, 3], [1, 3, 1, 3.5], [1, 3.5, 0, 3.5], [0, 3.5, 0, 0]])
    alike = np.vstack([room + 5.0 * k * np.array([1.0, 0.0, 1.0, 0.0]) for k in range(3)])
    result = checked(np.vstack([alike, ROOM + 20.0]))
    (finding,) = (one for one in result.findings if one.code == "looks_alike")
    assert set(finding.segments) <= set(range(18))
    assert len(finding.segments) > 9
    for place in result.places:
        away = place.similar_pose.x - place.pose.x
        assert abs(round(away / 5.0)) in (1, 2)
        assert away == pytest.approx(5.0 * round(away / 5.0), abs=0.05)
        assert place.similar_pose.y == pytest.approx(place.pose.y, abs=0.05)


def test_maps_far_out_and_of_one_segment() -> None:
    far = ROOM + np.array([5e6, -3e6, 5e6, -3e6])
    assert found(far) == {}
    one = checked(np.array([[0.0, 0.0, 3.0, 0.0]]))
    assert (one.findings, one.advice.oriented, one.complete) == ((), None, True)


def test_a_deadline_ends_it() -> None:
    index = index_of(faces())
    assert not check_map(index, Deadline(time.monotonic())).complete
    gone = Deadline()
    gone.cancel()
    with pytest.raises(CancelledError):
        check_map(index, gone)


MIRROR = np.array([1.0, -1.0, 1.0, -1.0])
MOVE = RigidTransform(-1.0, 2.0, 0.3)
LONG = pytest.mark.long


def told(walls: Floats, *, oriented: bool = True, moved: RigidTransform | None = None) -> SampleReport:
    """Conclude from the samples in a map; `moved` is applied to their stated poses. Each question is tried once."""
    return _told(walls.tobytes(), oriented, moved)


@cache
def _told(walls: bytes, oriented: bool, moved: RigidTransform | None) -> SampleReport:
    index = index_of(np.frombuffer(walls).reshape(-1, 4))
    samples = [
        try_sample(index, scan, Deadline(), oriented=oriented, said=None if moved is None else moved.compose(truth))
        for truth, scan in sampled()
    ]
    return concluded(index, samples, oriented=oriented)


def concluded(index: MapIndex, samples: Sequence[Sample], *, oriented: bool = True) -> SampleReport:
    return conclude(index, [scan for _, scan in sampled()][: len(samples)], samples, Deadline(), oriented=oriented)


def codes(report: SampleReport) -> list[str]:
    return [one.code for one in report.findings]


def test_nothing_is_told_of_a_map_that_is_right() -> None:
    report = told(faces(), moved=RigidTransform(0.0, 0.0, 0.0))
    assert codes(report) == []
    assert report.advice.oriented is True
    assert report.advice.sigma is not None
    assert report.advice.sigma < 0.02
    assert report.usable_as_advised >= report.usable


def test_lines_along_the_middle_of_walls() -> None:
    """The advice has half of a wall's thickness in it."""
    report = told(centre_lines())
    assert codes(report) == ["centre_lines", "undirected"]
    assert report.wall_thickness == pytest.approx(THICK, abs=0.02)
    assert report.advice.oriented is False
    assert report.advice.sigma == pytest.approx(0.5 * THICK, rel=0.35)


@pytest.mark.xfail(strict=True, reason="1 of 6 scans is usable as advised")
def test_with_the_advice_on_centre_lines_more_scans_are_usable() -> None:
    assert told(centre_lines()).usable_as_advised > told(centre_lines()).usable + 1


MIRRORED = reversed_ends(faces() * MIRROR)


@pytest.mark.parametrize(
    ("walls", "oriented", "expected", "thicker"),
    [
        (two_faces(THICK), True, [], None),
        (centre_lines(), False, ["centre_lines"], THICK),
        (reversed_ends(faces()), True, ["reversed"], None),
        # A mirrored map fits badly whatever its walls are; one that is too thick fits badly mirrored, too.
        (MIRRORED, True, ["mirrored"], None),
        *((two_faces(drawn), True, ["thickness"], THICK - drawn) for drawn in (0.04, 0.1, 0.35, 0.4)),
    ],
)
def test_what_the_samples_show_together(
    walls: Floats, oriented: bool, expected: list[str], thicker: float | None
) -> None:
    report = told(walls, oriented=oriented)
    assert codes(report) == expected
    assert report.wall_thickness == (None if thicker is None else pytest.approx(thicker, abs=0.02))
    assert not (expected and oriented and report.advice.sigma), "a bias of all walls is no sigma"


@pytest.mark.parametrize(
    ("factor", "unit"),
    [
        (0.98, ""),
        pytest.param(25.4, "millimetres taken for inches", marks=LONG),
        *(pytest.param(one, "", marks=LONG) for one in (1.01, 0.62, 2.5, 1.0 / 0.3048)),
        pytest.param(1.0 / 0.0254, "inches taken for metres", marks=LONG),
        pytest.param(304.8, "millimetres taken for feet", marks=LONG),
        pytest.param(1e-3, "metres taken for millimetres", marks=LONG),
    ],
)
def test_a_map_that_is_not_to_scale_or_of_another_unit(factor: float, unit: str) -> None:
    report = told(faces() * factor)
    assert codes(report) == ["scale"]
    message = report.findings[0].message
    assert unit in message
    said = float(message.partition("divide the map by ")[2].partition(",")[0])
    assert said == pytest.approx(factor, rel=1e-3 if unit else 0.004)


OF_SCANS = "divide the lengths of the scans by 1000. The scans seem to be in millimetres taken for metres."


def beyond_limits(factor: float) -> list[Scan]:
    return [scan_of(LaserScan(-3.0, 0.1, factor * np.linspace(1.0, 3.0, 60), 0.05, 12.0))] * 2


@pytest.mark.parametrize(
    ("scans", "said"),
    [
        ([scaled(scan, 1000.0) for _, scan in sampled()], OF_SCANS),
        *((beyond_limits(factor), "in another unit, such as millimetres; expected metres.") for factor in (1e3, 1e-3)),
    ],
)
def test_scans_of_another_unit_than_the_map_or_their_limits(scans: list[Scan], said: str) -> None:
    index = index_of(faces())
    samples = [try_sample(index, scan, Deadline(), oriented=True) for scan in scans]
    report = conclude(index, scans, samples, Deadline(), oriented=True)
    assert codes(report) == ["scale"]
    assert report.findings[0].message.endswith(said)


def test_a_single_sample_shows_a_mistake() -> None:
    index, (_, scan) = index_of(reversed_ends(faces())), sampled()[0]
    assert "reversed" in codes(concluded(index, [try_sample(index, scan, Deadline(), oriented=True)]))


def test_scans_that_see_nothing_show_nothing() -> None:
    index, blind = index_of(faces()), Scan(MeasuredSegments.from_segments(Segments.from_array([])))
    report = conclude(index, [blind], [try_sample(index, blind, Deadline(), oriented=True)], Deadline(), oriented=True)
    assert (report.findings, report.wall_thickness) == ((), None)


def test_a_scan_is_usable_here_as_it_is_where_it_is_asked() -> None:
    index = index_of(faces())
    asked = [associate(index, scan, options=AssociationOptions(on_map=1.0)).usable for _, scan in sampled()]
    samples = [try_sample(index, scan, Deadline(), oriented=True) for _, scan in sampled()]
    assert [one.result.usable for one in samples] == asked
    assert sum(asked) > len(asked) / 2
    assert concluded(index, samples).usable == sum(asked)


@pytest.mark.parametrize("seed", [1, 3])
def test_scans_of_another_building_say_nothing_of_this_one(seed: int) -> None:
    """They fit a little better mirrored, without directions, or shrunk to one room: all by chance."""
    report = told(maze(seed))
    assert codes(report) == []
    assert report.usable == 0


def test_poses_in_another_frame() -> None:
    report = told(faces(), moved=MOVE.inverse())
    assert codes(report) == ["moved"]
    assert "17.2 degrees" in report.findings[0].message
    said = report.findings[0].message.partition("moved by (")[2].partition(")")[0]
    assert [float(number) for number in said.split(", ")] == pytest.approx([-1.0, 2.0], abs=0.011)


def test_nothing_to_conclude_from() -> None:
    index = index_of(faces())
    for samples in ([], [None]):
        empty = conclude(index, [sampled()[0][1]] * len(samples), samples, Deadline(), oriented=True)
        assert (empty.findings, empty.usable, empty.advice.oriented) == ((), 0, None)


def test_a_deadline_leaves_out_what_it_has_no_time_for() -> None:
    index, (_, scan) = index_of(faces()), sampled()[0]
    passed = Deadline(time.monotonic())
    late = try_sample(index, scan, passed, oriented=True)
    assert isinstance(late, Sample)
    assert len(late.trials) == 1
    assert conclude(index, [scan], [late], passed, oriented=True).findings == ()
    gone = Deadline()
    gone.cancel()
    with pytest.raises(CancelledError):
        try_sample(index, scan, gone, oriented=True)


# --- Thickness of walls -----------------------------------------------------------------------------------------------


def test_no_thickness_without_trials() -> None:
    index, scans = index_of(centre_lines()), [scan for _, scan in sampled()]
    samples = [try_sample(index, scan, Deadline(), oriented=False) for scan in scans]
    late = [replace(one, trials=dict(list(one.trials.items())[:1])) for one in samples]
    assert conclude(index, scans, late, Deadline(), oriented=False).wall_thickness is None


def test_the_sentence_on_thickness_says_what_to_do() -> None:
    centres, thick, thin = (
        next(one for one in told(walls, oriented=oriented).findings if one.code in ("centre_lines", "thickness"))
        for walls, oriented in ((centre_lines(), False), (two_faces(0.1), True), (two_faces(0.35), True))
    )
    assert (centres.code, "thickness 0.2" in centres.message) == ("centre_lines", True)
    assert thick.code == thin.code == "thickness"
    assert "cm thicker than drawn" in thick.message
    assert "cm thinner than drawn" in thin.message
    assert "thickness plus 0.1" in thick.message
    assert "thickness minus 0.1" in thin.message
    assert re.search("`surface` [45].. cm smaller", thick.message)  # of a grid, which has no thickness
    assert re.search("`surface` [78].. cm greater", thin.message)
    assert "to its left" in thick.message
    assert not any("sigma" in one.message for one in (thin, thick))
