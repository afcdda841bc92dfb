"""Sample scans reveal changes of their map, and nothing in an unchanged map."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from association import AssociationOptions, CancelledError, Deadline, MapIndex, Scan, associate, scaled
from map_quality import Sample, SampleReport, conclude, try_sample
from registration import MeasuredSegments, RigidTransform, Segments
from registration.layout import Floats

from ...association.scenes import maze
from .drawn import THICK, centre_lines, faces, index_of, reversed_ends, sampled, two_faces

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
        try_sample(
            index,
            scan,
            Deadline(),
            oriented=oriented,
            said=None if moved is None else moved.compose(truth),
        )
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
    """Nearly none was usable without a recipe; the advice is one, and half of a wall's thickness is in it."""
    report = told(centre_lines())
    assert codes(report) == ["centre_lines", "undirected"]
    assert report.wall_thickness == pytest.approx(THICK, abs=0.02)
    assert report.advice.oriented is False
    assert report.advice.sigma == pytest.approx(0.5 * THICK, rel=0.35)
    assert report.usable_as_advised > report.usable + 1


def test_a_map_that_says_so_is_not_told_again() -> None:
    report = told(centre_lines(), oriented=False)
    assert codes(report) == ["centre_lines"]
    assert report.wall_thickness == pytest.approx(THICK, abs=0.02)


def test_a_map_the_wrong_way_round() -> None:
    report = told(reversed_ends(faces()))
    assert codes(report) == ["reversed"]
    assert report.advice.sigma is None


@pytest.mark.parametrize("factor", [0.98, 1.0 / 0.3048, *(pytest.param(one, marks=LONG) for one in (1.01, 0.62, 2.5))])
def test_a_map_that_is_not_to_scale(factor: float) -> None:
    report = told(faces() * factor)
    assert codes(report) == ["scale"]
    said = float(report.findings[0].message.partition("divide the map by ")[2].partition(",")[0])
    assert said == pytest.approx(factor, rel=0.004)


@pytest.mark.parametrize(
    ("factor", "said"),
    [
        (25.4, "millimetres taken for inches"),
        pytest.param(1.0 / 0.0254, "inches taken for metres", marks=LONG),
        pytest.param(1e-3, "metres taken for millimetres", marks=LONG),
    ],
)
def test_a_map_of_another_unit(factor: float, said: str) -> None:
    report = told(faces() * factor)
    assert codes(report) == ["scale"]
    assert f"divide the map by {factor:.4g}," in report.findings[0].message
    assert said in report.findings[0].message


def test_scans_of_another_unit() -> None:
    """Scans in millimetres; the map is in metres."""
    index, scans = index_of(faces()), [scaled(scan, 1000.0) for _, scan in sampled()]
    samples = [try_sample(index, scan, Deadline(), oriented=True) for scan in scans]
    report = conclude(index, scans, samples, Deadline(), oriented=True)
    assert codes(report) == ["scale"]
    assert report.findings[0].message.endswith(
        "divide the lengths of the scans by 1000. The scans seem to be in millimetres taken for metres."
    )


@pytest.mark.xfail(strict=True, reason="one scan does not show a mistake")
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


FALSE_SCALE = pytest.mark.xfail(strict=True, reason="a scale is found that is not there")


@pytest.mark.parametrize("seed", [pytest.param(1, marks=FALSE_SCALE), 3])
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


@pytest.mark.parametrize("drawn", [0.04, 0.1, 0.35])
def test_the_thickness_of_walls_too_thick_or_too_thin(drawn: float) -> None:
    assert told(two_faces(drawn)).wall_thickness == pytest.approx(THICK - drawn, abs=0.02)


def test_no_thickness_where_walls_are_right() -> None:
    assert told(faces()).wall_thickness is None
    assert told(two_faces(THICK)).wall_thickness is None


@pytest.mark.parametrize(
    ("walls", "code"), [(reversed_ends(faces() * MIRROR), "mirrored"), (two_faces(0.4), "thickness")]
)
def test_whether_a_map_is_mirrored_or_too_thick(walls: Floats, code: str) -> None:
    """A mirrored map fits badly whatever its walls are; one that is too thick fits badly mirrored, too."""
    assert codes(told(walls)) == [code]


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


def test_a_bias_of_all_walls_is_no_sigma() -> None:
    report = told(two_faces(0.1))
    assert codes(report) == ["thickness"]
    assert report.advice.sigma is None
